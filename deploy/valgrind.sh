#!/usr/bin/env bash
# A daemon under valgrind, from its start over a keyframe and its tiles to SIGTERM: fails on any error, and on memory
# that nobody knows of any more at the end. Usage: deploy/valgrind.sh
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
cd "$root"
. deploy/packages.sh
install_packages "${BUILD_PACKAGES[@]}" "${TEST_PACKAGES[@]}" "${VALGRIND_PACKAGES[@]}"
echo "== valgrind"
cmake --preset dev >/dev/null
cmake --build build/dev --target atlas atlasd
exec /usr/bin/python3 deploy/valgrind.py --bin build/dev/bin
