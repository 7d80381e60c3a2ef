// Whether a vehicle can have come from one keyframe to the next one of its session, by the places
// and times that it uploaded. Pure: the verdict on two keyframes depends on nothing else.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace atlas {

// docs/decisions/0505-quarantine-and-purge.md says where the defaults come from. How far two
// keyframes may be apart is the jump, however little time passed, and what the speed makes of that.
struct PlausibilityLimits {
  double max_speed_mps = 90.0;  // 0: as far as they like
  double max_jump_m = 50.0;
  double max_climb_mps = 15.0;  // the same up or down; 0: likewise
  double max_height_jump_m = 10.0;

  friend bool operator==(const PlausibilityLimits&, const PlausibilityLimits&) = default;
};

// Where and when a keyframe was taken, as it was uploaded.
struct UploadedPlace {
  std::uint32_t sequence = 0;
  std::int64_t time_ms = 0;
  std::int64_t x_um = 0;
  std::int64_t y_um = 0;
  std::int64_t z_um = 0;
};

// What cannot be, in one line for people: "keyframe 17 to 18: 812 m in 0.10 s, at most 90 m/s and
// 50 m". Which of the two is `a` does not matter.
std::optional<std::string> FindImplausible(const UploadedPlace& a,
                                           const UploadedPlace& b,
                                           const PlausibilityLimits& limits);

}  // namespace atlas
