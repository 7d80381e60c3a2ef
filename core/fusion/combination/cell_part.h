// The part of a cell that a change of some of its segments can reach: the altitudes where they are
// and were when they were combined last, and all segments that lie no further from them, or from
// one another, than segments have to do with each other.
//
// Within that reach they may be chained to one layer, adopted, or chosen instead of each other.
// What is left to look at is the layer below, whose column ends at the one above it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "core/fusion/segment/segment.h"
#include "core/geometry/map_profile.h"

namespace atlas {

// A segment of a cell, not looked at any closer yet.
struct CellSegment {
  Segment* segment = nullptr;
  std::int32_t altitude_mm = 0;
  std::uint32_t stretch = 0;  // its place
};

// From the lowest to the highest of its segments; altitudes in mm.
struct CellPart {
  // A layer's altitude is the mean of what was seen, not where one of its segments is.
  static constexpr std::int64_t kMargin_mm = 500;

  std::int64_t lowest_mm = 0;
  std::int64_t highest_mm = -1;

  bool operator==(const CellPart&) const = default;
  bool is_empty() const { return lowest_mm > highest_mm; }
  bool Contains(std::int64_t altitude_mm) const {
    return lowest_mm <= altitude_mm && altitude_mm <= highest_mm;
  }
  // Whether a layer there is where one of the part's should be.
  bool IsNear(std::int64_t altitude_mm) const {
    return lowest_mm - kMargin_mm <= altitude_mm && altitude_mm <= highest_mm + kMargin_mm;
  }
  void Add(std::int64_t altitude_mm) {
    *this = is_empty()
                ? CellPart{altitude_mm, altitude_mm}
                : CellPart{std::min(lowest_mm, altitude_mm), std::max(highest_mm, altitude_mm)};
  }
};

// How near to each other segments have to do with each other, and a segment with a layer of which
// none is further than the margin.
inline std::int64_t PartReach(const MapProfile& profile) {
  return std::max<std::int64_t>(profile.other_layer_mm + CellPart::kMargin_mm, profile.band_mm);
}

// `part`, not empty, with all segments that lie within its reach.
inline CellPart Grow(CellPart part, std::span<const CellSegment> segments, std::int64_t reach_mm) {
  for (;;) {
    CellPart grown = part;
    for (const CellSegment& s : segments) {  // without a branch: none could be foreseen
      const bool is_within =
          part.lowest_mm - reach_mm < s.altitude_mm && s.altitude_mm < part.highest_mm + reach_mm;
      grown.lowest_mm = std::min(grown.lowest_mm, is_within ? s.altitude_mm : grown.lowest_mm);
      grown.highest_mm = std::max(grown.highest_mm, is_within ? s.altitude_mm : grown.highest_mm);
    }
    if (grown == part) {
      return part;
    }
    part = grown;
  }
}

}  // namespace atlas
