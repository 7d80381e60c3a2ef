#!/usr/bin/env bash
# Every source is as clang-format 14 would write it. Usage: format_test.sh SOURCE_DIR
set -euo pipefail
cd "$1"
find core proto server client tests \( -name '*.h' -o -name '*.cc' -o -name '*.proto' \) -print0 |
  xargs -0 clang-format --dry-run -Werror
