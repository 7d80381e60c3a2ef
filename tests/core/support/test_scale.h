// How much a test tries: ATLAS_TEST_SCALE times as much as usual (default 1; 0.1 under sanitizers,
// 10 with deploy/test.sh --long).
#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>

namespace atlas::testing {

inline double Scale() {
  const char* text = std::getenv("ATLAS_TEST_SCALE");
  return text == nullptr ? 1.0 : std::atof(text);
}

// So many random worlds instead of the usual, and one at least.
inline std::uint32_t Scaled(std::uint32_t usual) {
  return static_cast<std::uint32_t>(std::max(1.0, std::round(Scale() * usual)));
}

// From one point of failure to the next: one in `usual`, more at a larger scale and less at a
// smaller one.
inline std::uint32_t Stride(std::uint32_t usual = 1) {
  return static_cast<std::uint32_t>(std::max(1.0, std::round(usual / std::max(Scale(), 0.01))));
}

// What a busy machine adds to a deadline, in milliseconds; ten times as much under sanitizers.
inline std::chrono::milliseconds Slack(int usual_ms) {
  return std::chrono::milliseconds(Scale() < 1.0 ? 10 * usual_ms : usual_ms);
}

}  // namespace atlas::testing
