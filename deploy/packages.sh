# Debian 12 packages, by purpose; sourced by the scripts beside it.
BUILD_PACKAGES=(
  g++ cmake ninja-build ccache pkg-config git
  libboost1.81-dev libboost-json1.81-dev
  libeigen3-dev libceres-dev libexpected-dev libnanoflann-dev libzstd-dev libxxhash-dev
  libprotobuf-dev protobuf-compiler
  libsqlite3-dev libsqlitecpp-dev
  libcli11-dev libtomlplusplus-dev libspdlog-dev libfmt-dev
  libssl-dev libpng-dev prometheus-cpp-dev libjemalloc-dev
)
TEST_PACKAGES=(libgtest-dev libgmock-dev clang-format openssl python3 python3-protobuf python3-xxhash python3-zstandard
  xz-utils)
BENCH_PACKAGES=(libbenchmark-dev openssl python3-protobuf python3-xxhash python3-zstandard)
# What python3-matplotlib needs. It is unpacked itself: it comes with another Boost than ours, by way of fonttools.
PLOT_PACKAGES=(python3-numpy python3-contourpy python3-cycler python3-dateutil python3-kiwisolver python3-packaging
  python3-pil python3-pyparsing python-matplotlib-data libqhull-r8.0)
TIDY_PACKAGES=(clang-tidy)
VALGRIND_PACKAGES=(valgrind)
FUZZ_PACKAGES=(clang libclang-rt-14-dev llvm)

# install_packages PACKAGE...: asks apt only for what is missing.
install_packages() {
  local missing=() package
  for package in "$@"; do
    dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'install ok installed' || missing+=("$package")
  done
  if ((${#missing[@]} == 0)); then
    return
  fi
  local sudo=()
  if ((EUID != 0)); then
    command -v sudo >/dev/null || {
      echo "missing packages: ${missing[*]}; run as root or install sudo" >&2
      return 1
    }
    sudo=(sudo)
  fi
  "${sudo[@]}" apt-get update -qq
  "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
}

# unpack_package PACKAGE DIR: its files without installing it, for a program whose package would start a service,
# or one that comes with what others here do not go with.
unpack_package() {
  local package=$1 folder=$2
  [[ -d $folder/usr ]] && return
  mkdir -p "$folder"
  (cd "$folder" && apt-get download -qq "$package" 2>/dev/null && dpkg-deb -x "$package"_*.deb .) ||
    { echo "cannot download the package $package" >&2; return 1; }
}
