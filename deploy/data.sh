# Where the real drives are; sourced by the scripts beside it. Sets and exports ATLAS_DATA when they
# can be found: as given, or unpacked from ../shared/data beside the repository.
find_data() {
  local root=$1
  if [[ -n ${ATLAS_DATA:-} ]]; then
    export ATLAS_DATA
  elif [[ -x $root/../shared/data/unpack.sh ]]; then
    ATLAS_DATA=$("$root/../shared/data/unpack.sh")
    export ATLAS_DATA
  fi
}
