#!/usr/bin/env bash
# Installs, builds once and runs every test. Usage: deploy/test.sh [--sanitize [--without-fuzzers] [--minutes N]] [--long]
#   --sanitize  also ASan+UBSan over unit and integration tests at a tenth of the scale, but those that
#               compute for minutes (label compute), TSan over the tests labelled threads, and 10 s of
#               each fuzzer
#   --without-fuzzers
#               these not: what they found before and mutations of it are tried under ASan all the same
#   --minutes N what a sanitizer has to build or to run is left out, and said so, where so many minutes are over
#               before it is done: for whoever has a limit and, on a slow machine, nothing in ccache yet
#   --long      ten times as many random worlds in the tests that make them, the same payloads from
#               g++ and clang++, a daemon's life under valgrind, and clang-tidy over all sources
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
cd "$root"
usage() {
  echo "usage: deploy/test.sh [--sanitize [--without-fuzzers] [--minutes N]] [--long]" >&2
  exit 2
}
sanitize=0
fuzzers=1
long=0
minutes=
while (($#)); do
  case $1 in
    --sanitize) sanitize=1 ;;
    --without-fuzzers) fuzzers=0 ;;
    --minutes) minutes=${2:-}; shift; [[ $minutes =~ ^[1-9][0-9]*$ ]] || usage ;;
    --long) long=1 ;;
    *) usage ;;
  esac
  shift
done
. deploy/packages.sh
. deploy/data.sh
install_packages "${BUILD_PACKAGES[@]}" "${TEST_PACKAGES[@]}"
find_data "$root"
[[ -n ${ATLAS_DATA:-} ]] || echo "ATLAS_DATA is not set and ../shared/data is not there: tests on real drives will be skipped"

# How many lives of an atlas the property test of this build has compared with the oracle.
report_property() {
  awk '/^property: / { shards++; cases += $2; steps += $4; restarts += $6; digests += $10; past += $15 }
    END {
      if (shards) printf "property test: %d cases, %d steps, %d restarts, %d digests and %d of the past equal the oracle\n",
        cases, steps, restarts, digests, past
    }' "build/$1/Testing/Temporary/LastTest.log"
}

# run PRESET TARGET CTEST_ARGUMENT...: configures, builds, tests.
run() {
  local preset=$1 target=$2
  shift 2
  echo "== $preset"
  cmake --preset "$preset" >/dev/null
  cmake --build "build/$preset" --target "$target"
  ctest --test-dir "build/$preset" --output-on-failure --no-tests=error --timeout 900 -j 2 "$@"
  report_property "$preset"
}

# run_in_time SECONDS PRESET TARGET CTEST_ARGUMENT...: the same, if it is built so long before the time is up.
run_in_time() {
  local tests_s=$1 preset=$2 target=$3
  shift
  if [[ -n $minutes ]]; then
    local left_s=$((60 * minutes - SECONDS - tests_s)) status=0
    cmake --preset "$preset" >/dev/null
    ((left_s > 0)) && timeout "$left_s" cmake --build "build/$preset" --target "$target" || status=$?
    if ((left_s <= 0 || status == 124)); then
      echo "== $preset: LEFT OUT, $((SECONDS / 60)) of $minutes minutes are over; deploy/test.sh --sanitize has all of it"
      return
    fi
    ((status == 0)) || return "$status"
  fi
  run "$@"
}

scale=1
((long)) && scale=10
# How many lives of an atlas there are is the script's to say.
unset ATLAS_PROPERTY_CASES
((long)) && export ATLAS_PROPERTY_CASES=10000
export ATLAS_TEST_SCALE=$scale
run dev all
if ((sanitize)); then
  unset ATLAS_PROPERTY_CASES
  export ATLAS_TEST_SCALE=0.1
  run_in_time 900 asan all -L 'unit|integration' -LE 'data|compute'
  run_in_time 420 tsan threads_tests -L threads
  ((fuzzers == 0)) || deploy/fuzz.sh 10
fi
if ((long)); then
  deploy/compilers.sh
  deploy/valgrind.sh
  echo "== clang-tidy"
  deploy/tidy.sh
fi
