// Where a scan and the map cannot both be right.
#pragma once

#include <cstdint>
#include <functional>
#include <string_view>

namespace atlas {

enum class ContradictionKind : std::uint8_t {
  kAppeared,  // returns where the map measured free space
  kVanished,  // rays through what the map says stands there
  kMoving,    // something was where the map is free, and then it was not
};
std::string_view ContradictionKindName(ContradictionKind kind);

// Of one cell of level 0 and one of its layers: segments of a column that lie on top of each other.
struct Contradiction {
  ContradictionKind kind = ContradictionKind::kAppeared;
  // The cell covers [cell_x, cell_x + 1) x [cell_y, cell_y + 1) cell sizes of the world frame.
  std::int64_t cell_x = 0;
  std::int64_t cell_y = 0;
  std::int32_t altitude_mm = 0;  // of the layer that the column stands on
  std::int32_t low_mm = 0;       // of the segments, world frame
  std::int32_t high_mm = 0;
  // Scans in which something was measured there, and in which rays passed; of the segment that says
  // most.
  std::uint32_t hits = 0;
  std::uint32_t passes = 0;
  std::uint32_t first_scan = 0;  // of those
  std::uint32_t last_scan = 0;
  double score = 0.0;  // log of how much likelier the scans are if it is so (segment_evidence.h)

  friend bool operator==(const Contradiction&, const Contradiction&) = default;
};

using OnContradiction = std::function<void(const Contradiction&)>;

}  // namespace atlas
