#!/usr/bin/env bash
# Takes what the fuzzers found (deploy/fuzz.sh, build/fuzz/corpus) into tests/fuzz/corpus, where every test run replays
# it: of each target the fewest inputs of up to 2 KiB that reach the same edges, and 32 at most. Usage:
# deploy/fuzz_corpus.sh [TARGET...] (all that were fuzzed). Those with a name of their own, which once broke something,
# stay; those of an earlier run are replaced.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
cd "$root"
most=32
if (($#)); then
  targets=("$@")
else
  mapfile -t targets < <(ls build/fuzz/corpus)
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for target in "${targets[@]}"; do
  small=$work/$target.small reached=$work/$target.reached kept=tests/fuzz/corpus/$target
  mkdir -p "$small" "$reached" "$kept"
  find "build/fuzz/corpus/$target" -type f -size -5 -exec cp -t "$small" {} +  # of 512 bytes: 4 at most
  "build/fuzz/bin/fuzz_$target" -merge=1 -set_cover_merge=1 -use_counters=0 -rss_limit_mb=2048 \
    "$reached" "$small" >"$work/$target.log" 2>&1 || { tail "$work/$target.log" >&2; exit 1; }
  find "$kept" -regextype posix-extended -type f -regex '.*/[0-9a-f]{40}' -delete
  # Where there are more, the largest: they reach most by themselves.
  find "$reached" -type f -printf '%s %p\n' | sort -rn | head -"$most" | cut -d' ' -f2 | xargs -r cp -t "$kept"
  printf '%-16s %3d inputs, %6d bytes\n' "$target" "$(ls "$kept" | wc -l)" "$(cat "$kept"/* | wc -c)"
done
