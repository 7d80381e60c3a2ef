#!/usr/bin/env bash
# Runs the benchmarks named (all, if none) and prints one JSON line a figure:
# {"name", "value", "unit", "against", "ratio"}. Usage: deploy/bench.sh [NAME...] [--long]; deploy/bench.sh --help
# lists the names.
# All but fusion, accuracy, online, passes, corrections, restarts, scaling, unread, crowd, soak and purge need the
# drives of docs/data.md in $ATLAS_DATA; accuracy takes the meshes there too. curbs prints a line a threshold instead.
# curbs, online, passes, follow, planning, monitoring, merge and localization, and soak --long, draw docs/images/*.png; localization writes
# docs/results/localization.csv and .md, too (tracking is its second half alone). --long: memory with an atlas of 5 GiB, too
# (10 GiB of disk, half an hour), soak for 90 minutes instead of 3. Exit code 1: a figure of soak or restart is not what
# was asked.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
cd "$root"
for argument in "$@"; do
  [[ $argument == --help || $argument == -h ]] && exec python3 deploy/bench.py --help
done
. deploy/packages.sh
. deploy/data.sh
install_packages "${BUILD_PACKAGES[@]}" "${BENCH_PACKAGES[@]}" "${PLOT_PACKAGES[@]}" python3 xz-utils >&2
find_data "$root"
unpack_package nginx build/nginx >&2
unpack_package python3-matplotlib build/matplotlib >&2
unpack_package python3-fonttools build/fonttools >&2
modules=usr/lib/python3/dist-packages
export PYTHONPATH=$root/build/matplotlib/$modules:$root/build/fonttools/$modules
PYTHONPATH+=:$root/client/python:$root/build/bench/python
cmake --preset bench >/dev/null
cmake --build build/bench >&2
exec /usr/bin/python3 deploy/bench.py --bin build/bench/bin --nginx build/nginx/usr/sbin/nginx "$@"
