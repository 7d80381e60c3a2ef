#!/usr/bin/env bash
# Runs a command with ATLAS_DATA set to the recorded drives where they can be found (deploy/data.sh).
# Usage: with_drives.sh [COMMAND ARGUMENT…]; without one it only makes sure that they are unpacked.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
. "$root/deploy/data.sh"
find_data "$root"
if (($#)); then
  exec "$@"
fi
