#!/usr/bin/env bash
# Fuses the same drives with g++ and clang++, each at -O0 and -O3, and compares the payloads with the
# golden ones. Usage: deploy/compilers.sh
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
cd "$root"
. deploy/packages.sh
install_packages "${BUILD_PACKAGES[@]}" "${TEST_PACKAGES[@]}" clang
for compiler in g++ clang++; do
  for level in -O0 -O3; do
    build=build/compilers/$compiler$level
    echo "== $compiler $level"
    cmake --preset debug -B "$build" -DCMAKE_CXX_COMPILER=$compiler -DCMAKE_CXX_FLAGS_DEBUG=$level \
      -DATLAS_WERROR=OFF >/dev/null
    cmake --build "$build" --target core_fusion_test
    "$build/bin/core_fusion_test" --gtest_filter='FusionGoldenTest.*:TileFusionPropertyTest.*'
  done
done
