// What one visit saw that another did not, though it looked.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/keyframe_key.h"

namespace atlas {

enum class ChangeKind : std::uint8_t {
  kAppeared,  // stands where nothing stood before
  kVanished   // stood where nothing stands any more
};
std::string_view ChangeKindName(ChangeKind kind);

// Cell sizes of level 0 from the world's origin.
struct ChangedCell {
  std::int64_t x = 0;
  std::int64_t y = 0;
};

// Cells that hang together, as one thing.
struct MapChange {
  ChangeKind kind = ChangeKind::kAppeared;
  SessionKey seen_by;                                  // the later visit
  Eigen::Vector2d center_m = Eigen::Vector2d::Zero();  // middle of the cells, world
  Eigen::Vector2d min_m = Eigen::Vector2d::Zero();     // around the cells
  Eigen::Vector2d max_m = Eigen::Vector2d::Zero();
  double low_m = 0.0;  // of its segments, world frame
  double high_m = 0.0;
  std::size_t segments = 0;
  std::vector<ChangedCell> cells;
};

}  // namespace atlas
