#!/usr/bin/env bash
# Installs the programs and the client library into a folder of their own, builds a project of a vehicle and
# the examples of docs/client.md against it, and runs all of them. Usage: install_test.sh SOURCE BUILD CMAKE COMPILER
set -euo pipefail
source=$1 build=$2 cmake=$3 compiler=$4
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$cmake" --install "$build" --prefix "$folder/prefix" >/dev/null
"$cmake" --install "$build" --prefix "$folder/programs" --component programs >/dev/null
[[ $(find "$folder/programs" -type f -printf '%P\n' | sort | xargs) == "bin/atlas bin/atlas-merge bin/atlasd" ]]
if grep -rlE '<boost/asio|\.pb\.h|google/protobuf|<openssl|nanoflann|sqlite3?\.h|SQLiteCpp|"server/' "$folder/prefix/include"; then
  echo "public headers include what should stay behind the library"
  exit 1
fi
cp -r "$source/tests/client/install/project" "$folder/project"
awk '/^```cpp$/ { on = 1; next } /^```$/ { on = 0 } on' "$source/docs/client.md" >"$folder/project/examples.cc"
[[ -s "$folder/project/examples.cc" ]]
"$cmake" -S "$folder/project" -B "$folder/build" -DCMAKE_PREFIX_PATH="$folder/prefix" \
  -DCMAKE_CXX_COMPILER="$compiler" >/dev/null
"$cmake" --build "$folder/build"
"$folder/build/vehicle" "$folder/tiles"
[[ $("$folder/build/localized") == "lost without a map, no route" ]]

# An atlas without a tile, as its daemon left it.
mkfifo "$folder/said"
"$folder/prefix/bin/atlasd" --data "$folder/atlas" --listen 127.0.0.1:0 --log-level error >"$folder/said" &
daemon=$!
read -r _ address <"$folder/said"
"$folder/prefix/bin/atlas" status --server "$address" >/dev/null
kill "$daemon"
wait "$daemon"
[[ $("$folder/build/map_of_file" "$folder/atlas/atlas.db" 0 0) == "0 tiles, current" ]]
error=$("$folder/build/map_of_file" "$folder/project/main.cc" 0 0 2>&1) && exit 1
[[ $error == invalid_data:* ]]
