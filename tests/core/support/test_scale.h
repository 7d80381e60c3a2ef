// How many random worlds a test makes: ATLAS_TEST_SCALE times as many as usual (default 1; 0.1
// under sanitizers, 10 with deploy/test.sh --long), and one at least.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>

namespace atlas::testing {

inline std::uint32_t Scaled(std::uint32_t usual) {
  const char* text = std::getenv("ATLAS_TEST_SCALE");
  const double scale = text == nullptr ? 1.0 : std::atof(text);
  return static_cast<std::uint32_t>(std::max(1.0, std::round(scale * usual)));
}

}  // namespace atlas::testing
