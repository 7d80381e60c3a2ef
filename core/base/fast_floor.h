// Rounding down to an integer without a call: std::floor is one where vectors are old.
#pragma once

#include <cstdint>

namespace atlas {

// Requires |v| < 2^31.
inline std::int32_t FastFloor(float v) {
  const auto truncated = static_cast<std::int32_t>(v);
  return truncated - static_cast<std::int32_t>(v < static_cast<float>(truncated));
}

}  // namespace atlas
