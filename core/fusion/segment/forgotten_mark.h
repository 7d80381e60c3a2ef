// Preset bounded: what is still known of the segments of a cell that were forgotten.
#pragma once

#include <cstdint>

namespace atlas {

// Of those of a vehicle, or of any, in a band of altitude: none would come before this when it is
// chosen what counts (core/fusion/combination/forgetting.h).
struct ForgottenMark {
  static constexpr std::uint32_t kAnyVehicle = 0xFFFF'FFFF;

  std::int64_t last_time_ms = 0;
  std::uint32_t vehicle = kAnyVehicle;  // as the views'
  std::int32_t band = 0;
  bool is_strong = false;
};

}  // namespace atlas
