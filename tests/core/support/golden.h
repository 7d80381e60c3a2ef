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

inline std::string GoldenPath(const std::string& name) {
  return std::string(ATLAS_GOLDEN_DIR) + "/" + name;
}

// The content of tests/golden/NAME; empty: there is none.
inline Bytes GoldenFile(const std::string& name) {
  std::ifstream in(GoldenPath(name), std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

// The same of today's version. With ATLAS_WRITE_GOLDEN set in the environment `fresh` is written
// there first: for a new format version, never for an old one.
inline Bytes GoldenFile(const std::string& name, ByteSpan fresh) {
  if (std::getenv("ATLAS_WRITE_GOLDEN") != nullptr) {
    std::ofstream out(GoldenPath(name), std::ios::binary);
    std::copy(fresh.begin(), fresh.end(), std::ostreambuf_iterator<char>(out));
  }
  return GoldenFile(name);
}

}  // namespace atlas::testing
