#!/usr/bin/env bash
# From a fresh machine to a map on the screen: installs, builds `release`, starts atlasd on loopback,
# maps a drive, localizes a second pass in it, plans a route, draws a picture.
# Usage: deploy/quickstart.sh [DRIVE]
#   Without a folder: a simulated multi-storey garage; a second drive with another seed is localized.
#   With one (velodyne/ and poses.txt, docs/data.md): its even scans are mapped, the odd ones localized.
# Leaves everything in build/quickstart; run again, it starts over.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
if (($# > 0)) && [[ ! -d $1/velodyne || ! -f $1/poses.txt ]]; then
  echo "quickstart: there is no drive in '$1': expected velodyne/ and poses.txt. docs/data.md says where public drives" \
    "come from; without a folder a drive is simulated" >&2
  exit 2
fi
drive=${1:+$(cd "$1" && pwd)}
cd "$root"
. deploy/packages.sh

say() { printf '\n== %s\n' "$*"; }

say "installing what is missing"
install_packages "${BUILD_PACKAGES[@]}" python3

say "building"
cmake --preset release >/dev/null
cmake --build build/release --target atlas atlasd atlas-merge
atlas=$root/build/release/bin/atlas
work=$root/build/quickstart
rm -rf "$work"
mkdir -p "$work"

say "starting atlasd"
"$root/build/release/bin/atlasd" --data "$work/atlas" --listen 127.0.0.1:0 >"$work/atlasd.out" 2>"$work/atlasd.log" &
daemon=$!
trap 'kill "$daemon" 2>/dev/null; wait "$daemon" || true' EXIT
for _ in $(seq 100); do
  grep -q '^listening' "$work/atlasd.out" && break
  kill -0 "$daemon" || { cat "$work/atlasd.log" >&2; exit 1; }
  sleep 0.1
done
ATLAS_SERVER=$(awk '/^listening/ {print $2}' "$work/atlasd.out")
export ATLAS_SERVER
echo "atlasd listens on $ATLAS_SERVER"

# position LINE FILE: "x,y,z" of a pose, the line counted as sed does.
position() { sed -n "$1p" "$2" | awk '{print $4 "," $8 "," $12}'; }

if [[ -z $drive ]]; then
  say "simulating a garage: a drive from the ground to the top deck, and a second one"
  "$atlas" simulate garage -o "$work/first"
  "$atlas" simulate garage -o "$work/second" --seed 1
  drive=$work/first
  second=$work/second
  map=()
  rest=()
else
  second=$drive
  map=(--scans even)
  rest=(--scans odd)
fi

say "mapping"
"$atlas" ingest "$drive" "${map[@]}"
"$atlas" wait
"$atlas" status

say "asking for the map around the start"
from=$(position 1 "$drive/poses.txt")
to=$(position '$' "$drive/poses.txt")
"$atlas" query --center "${from%,*}" --radius 20
"$atlas" point "$(cut -d, -f1 <<<"$from")" "$(cut -d, -f2 <<<"$from")"

say "localizing a second pass"
"$atlas" localize "$second" "${rest[@]}" | tail -n 12

say "planning from the first pose to the last"
"$atlas" plan --from "$from" --to "$to" | tail -n 8 || {
  status=$?
  ((status == 3)) || exit "$status"  # no route is an answer, too: the drive may have jumped
}

say "drawing"
"$atlas" render -o "$work/map.png"
"$atlas" render -o "$work/layers.png" --color layers
echo "the map is in $work/map.png; the daemon's log in $work/atlasd.log"
