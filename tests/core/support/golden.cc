#include "tests/core/support/golden.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <ios>
#include <iterator>

namespace atlas::testing {

std::string GoldenPath(const std::string& name) {
  return std::string(ATLAS_GOLDEN_DIR) + "/" + name;
}

Bytes GoldenFile(const std::string& name) {
  std::ifstream in(GoldenPath(name), std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

Bytes GoldenFile(const std::string& name, ByteSpan fresh) {
  if (std::getenv("ATLAS_WRITE_GOLDEN") != nullptr) {
    std::ofstream out(GoldenPath(name), std::ios::binary);
    std::copy(fresh.begin(), fresh.end(), std::ostreambuf_iterator<char>(out));
  }
  return GoldenFile(name);
}

}  // namespace atlas::testing
