// A session's keyframes cut into submaps: each belongs to one, so that what two neighbours say of
// each other's place is not what they share.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/geometry/pose.h"

namespace atlas {

struct CutOptions {
  double length_m = 10.0;          // of a submap's way, above 0
  std::size_t max_keyframes = 24;  // of a submap: of a vehicle that stands
  double jump_m = 10.0;  // a longer step ends a submap: nothing is known of what was there
};

// Keyframes [begin, end).
struct SubmapCut {
  std::size_t begin = 0;
  std::size_t end = 0;
  bool follows_jump = false;  // what is before it is not odometry

  friend bool operator==(const SubmapCut&, const SubmapCut&) = default;
};

// All of them, in their order; `T_world_sensor` of each, as odometry has them. Between two jumps
// submaps are equally long, as near to `length_m` as that allows: at an end nothing is left over.
std::vector<SubmapCut> CutSession(std::span<const Pose> T_world_sensor, const CutOptions& options);

}  // namespace atlas
