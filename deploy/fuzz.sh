#!/usr/bin/env bash
# Builds the fuzzers with clang and runs each for so long. Usage: deploy/fuzz.sh [SECONDS] [TARGET...]
# (60 s, all targets: tests/fuzz). What they find stays in build/fuzz/corpus/TARGET and is where the
# next run begins; an input that breaks something is in build/fuzz/findings, and the script fails.
# How many run at once: ATLAS_FUZZ_JOBS, else one a core.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
cd "$root"
seconds=${1:-60}
shift || true
[[ $seconds =~ ^[1-9][0-9]*$ ]] || { echo "usage: deploy/fuzz.sh [SECONDS] [TARGET...]" >&2; exit 2; }
. deploy/packages.sh
install_packages "${BUILD_PACKAGES[@]}" "${FUZZ_PACKAGES[@]}"
if (($#)); then
  targets=("$@")
else
  mapfile -t targets < <(cd tests/fuzz && printf '%s\n' fuzz_*.cc | sed 's/^fuzz_//; s/\.cc$//')
fi
echo "== fuzz"
cmake --preset fuzz >/dev/null
cmake --build build/fuzz --target "${targets[@]/#/fuzz_}"
mkdir -p build/fuzz/{logs,findings,corpus}

# One input may take 10 s and 512 MiB, whatever it says of itself. The quarantine is less than usual: it
# counts as memory.
fuzz_one() {
  local target=$1 seconds=$2
  local program=build/fuzz/bin/fuzz_$target corpus=build/fuzz/corpus/$target
  local committed=tests/fuzz/corpus/$target
  mkdir -p "$corpus"
  "$program" --write-seeds "$corpus" || return 1
  [[ -d $committed ]] || committed=
  ASAN_OPTIONS=quarantine_size_mb=16:allocator_may_return_null=1 UBSAN_OPTIONS=print_stacktrace=1 \
    "$program" -max_total_time="$seconds" -max_len=65536 -timeout=10 -rss_limit_mb=512 -print_final_stats=1 \
    -artifact_prefix="build/fuzz/findings/$target-" "$corpus" $committed >"build/fuzz/logs/$target.log" 2>&1
}
export -f fuzz_one

failed=0
printf '%s\n' "${targets[@]}" |
  xargs -P "${ATLAS_FUZZ_JOBS:-$(nproc)}" -I{} bash -c 'fuzz_one "$1" "$2"' _ {} "$seconds" || failed=1
for target in "${targets[@]}"; do
  log=build/fuzz/logs/$target.log
  awk -v target="$target" '
    /^#[0-9]+.* cov: / { for (i = 1; i < NF; ++i) { if ($i == "cov:") edges = $(i + 1); if ($i == "ft:") features = $(i + 1) } }
    /^stat::number_of_executed_units/ { executions = $2 }
    /^stat::peak_rss_mb/ { memory = $2 }
    END { printf "%-16s %10d executions, %6d edges, %6d features, %4d MiB\n", target, executions, edges, features, memory }
  ' "$log"
done
((failed == 0)) || {
  echo "a fuzzer found something: build/fuzz/findings, build/fuzz/logs" >&2
  exit 1
}
