#!/usr/bin/env bash
# Installs, builds once and runs every test. Usage: deploy/test.sh [--sanitize [--without-fuzzers] [--minutes N]] [--long]
#   --sanitize  also TSan over the tests labelled threads, ASan+UBSan over unit and integration tests at a
#               tenth of the scale, but (without --long) those that compute for minutes (label compute),
#               and 10 s of each fuzzer
#   --without-fuzzers
#               these not: what they found before and mutations of it are tried under ASan all the same
#   --minutes N what a sanitizer has to build or to run is left out, and said so, where so many minutes are over
#               before it is done: for whoever has a limit and, on a slow machine, nothing in ccache yet
#   --long      ten times as many random worlds in the tests that make them, 2,100 kills of a daemon, 11,520
#               uploads over links that fail, the same payloads from g++ and clang++, a daemon's life under
#               valgrind, and clang-tidy over all sources
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

# build_and_test PRESET TARGET CTEST_ARGUMENT...: configures, builds, tests.
build_and_test() {
  local preset=$1 target=$2
  shift 2
  echo "== $preset"
  cmake --preset "$preset" >/dev/null
  cmake --build "build/$preset" --target "$target"
  run_tests "$preset" "$@"
  report_property "$preset"
}

run_tests() {
  local preset=$1
  shift
  ctest --test-dir "build/$preset" --output-on-failure --no-tests=error --timeout 900 -j 2 "$@"
}

# left_out PRESET WHAT: says what the minutes were too few for.
left_out() {
  echo "== $1: LEFT OUT $2, $((SECONDS / 60)) of $minutes minutes are over; deploy/test.sh --sanitize has all of it"
}

# build_and_test_in_time RESERVE_S PRESET TARGET CTEST_ARGUMENT...: the same where there are no minutes. Where there are,
# what is not built or tested RESERVE_S seconds before they are over is left out.
build_and_test_in_time() {
  local reserve_s=$1 preset=$2 target=$3
  shift
  if [[ -z $minutes ]]; then
    build_and_test "$@"
    return
  fi
  local left_s=$((60 * minutes - reserve_s - SECONDS)) status=0
  echo "== $preset"
  cmake --preset "$preset" >/dev/null
  ((left_s > 0)) && timeout "$left_s" cmake --build "build/$preset" --target "$target" || status=$?
  if ((left_s <= 0 || status == 124)); then
    left_out "$preset" "all of it"
    return
  fi
  ((status == 0)) || return "$status"
  shift 2
  # What runs when the time is up is ended and counts as failed: it, and nothing else, is run again.
  local log=build/$preset/until_the_time_is_up.log
  left_s=$((60 * minutes - reserve_s - SECONDS))
  run_tests "$preset" "$@" --stop-time "$(date -d "+$((left_s > 1 ? left_s : 1)) seconds" +%T)" 2>&1 | tee "$log" || status=$?
  if grep -q '^The stop time has been passed' "$log"; then
    left_out "$preset" "the last of $(sed -n 's|^ *[0-9]*/\([0-9]*\) Test .*|\1|p' "$log" | head -1) tests"
    if ((status != 0)) && ! grep -q '\*\*\*\(Failed\|Exception\|Not Run\)' "$log"; then
      status=0
      run_tests "$preset" --rerun-failed || status=$?
    fi
  fi
  ((status != 0)) || report_property "$preset"
  return "$status"
}

scale=1
((long)) && scale=10
# How many lives of an atlas there are is the script's to say.
unset ATLAS_PROPERTY_CASES
((long)) && export ATLAS_PROPERTY_CASES=10000
export ATLAS_TEST_SCALE=$scale
build_and_test dev all
if ((sanitize)); then
  unset ATLAS_PROPERTY_CASES
  export ATLAS_TEST_SCALE=0.1
  too_long_for_asan='data|compute'
  ((!long)) || too_long_for_asan='data'
  # The quicker one first: where there are minutes the other has what is left of them.
  build_and_test_in_time 600 tsan threads_tests -L threads
  build_and_test_in_time 600 asan all -L 'unit|integration' -LE "$too_long_for_asan"
  ((fuzzers == 0)) || deploy/fuzz.sh 10
fi
if ((long)); then
  # As many as docs/reliability.md tells of.
  ATLAS_TEST_SCALE=70 run_tests dev -R LedgerCrashTest
  ATLAS_TEST_SCALE=20 run_tests dev -R UploadFaultsTest
  deploy/compilers.sh
  deploy/valgrind.sh
  echo "== clang-tidy"
  deploy/tidy.sh
fi
