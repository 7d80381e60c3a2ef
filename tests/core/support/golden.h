// Golden files: bytes that a released version wrote and every later one must still read.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <ios>
#include <iterator>
#include <string>

#include "core/base/bytes.h"

namespace atlas::testing {

// The content of tests/golden/NAME. With ATLAS_WRITE_GOLDEN set in the environment `fresh` is
// written there first: for a new format version, never for an old one.
inline Bytes GoldenFile(const std::string& name, ByteSpan fresh) {
  const std::string path = std::string(ATLAS_GOLDEN_DIR) + "/" + name;
  if (std::getenv("ATLAS_WRITE_GOLDEN") != nullptr) {
    std::ofstream out(path, std::ios::binary);
    std::copy(fresh.begin(), fresh.end(), std::ostreambuf_iterator<char>(out));
  }
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

}  // namespace atlas::testing
