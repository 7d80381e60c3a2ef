#!/usr/bin/env bash
# systemd takes deploy/*.service without a word. Usage: unit_test.sh SOURCE_DIR ; 77: there is no systemd to ask.
set -euo pipefail
command -v systemd-analyze > /dev/null || exit 77
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for unit in "$1"/deploy/*.service; do
  # The programs are not installed where this runs.
  sed -E 's#^(ExecStart=)\S+#\1/bin/true#' "$unit" > "$work/$(basename "$unit")"
  said=$(systemd-analyze verify "$work/$(basename "$unit")" 2>&1) || { echo "$said"; exit 1; }
  [ -z "$said" ] || { echo "$said"; exit 1; }
done
