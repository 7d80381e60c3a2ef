// The part of a cell that a change of some of its segments can reach: the bands of altitude that
// segments are in, up to the next empty one to either side.
//
// A band is at least as high as the distance from which on two altitudes are never of one layer:
// across an empty one no segment is chained, adopted, chosen or kept out because of another. What
// is left to look at is the layer below, whose column ends at the one above it.
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
  std::uint32_t stretch = 0;  // its place
  std::int32_t band = 0;
};

struct CellPart {
  std::int32_t lowest = 1;  // bands
  std::int32_t highest = 0;

  bool is_empty() const { return lowest > highest; }
  bool Contains(std::int32_t band) const { return lowest <= band && band <= highest; }

  void Add(std::int32_t band) {
    *this = is_empty() ? CellPart{band, band}
                       : CellPart{std::min(lowest, band), std::max(highest, band)};
  }
};

// Whether the cells of such a map have parts.
inline bool HaveParts(const MapProfile& profile) {
  return profile.band_mm >= profile.other_layer_mm && profile.preset != FusionPreset::kPaper;
}

// Around all that are revised; empty if none is.
inline CellPart FindRevisedPart(std::span<const CellSegment> segments) {
  CellPart part;
  for (const CellSegment& s : segments) {
    if (s.segment->is_revised) {
      part.Add(s.band);
    }
  }
  for (bool grows = !part.is_empty(); grows;) {
    grows = false;
    for (const CellSegment& s : segments) {
      if (s.band == part.lowest - 1 || s.band == part.highest + 1) {
        part.Add(s.band);
        grows = true;
      }
    }
  }
  return part;
}

}  // namespace atlas
