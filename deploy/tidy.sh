#!/usr/bin/env bash
# Checks every source file with clang-tidy (.clang-tidy), or those named. Usage: deploy/tidy.sh [FILE...]
# Some 15 minutes on two cores; exits 1 if any finding stands, after all files.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
cd "$root"
. deploy/packages.sh
install_packages "${BUILD_PACKAGES[@]}" "${TEST_PACKAGES[@]}" "${TIDY_PACKAGES[@]}"
cmake --preset dev >/dev/null
cmake --build build/dev --target atlas_proto >/dev/null  # generated headers
exec /usr/bin/python3 deploy/tidy.py build/dev/compile_commands.json "$@"
