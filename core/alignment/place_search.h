// Which submaps of other sessions look like a place, with no idea of where it may be.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/alignment/submap.h"
#include "core/geometry/pose.h"

namespace atlas {

struct PlaceSearchOptions {
  std::size_t candidates = 8;
  // Of RangeProfile's differences, which are at most 3,072: more is another place.
  std::uint32_t max_difference = 1'300;
};

using SubmapPlaces = std::span<const SubmapPlace>;  // of one

// A submap among those searched, and where the searcher would lie in it.
struct SubmapCandidate {
  std::size_t submap = 0;
  Pose T_submap_searcher = Pose::Identity();
  std::uint32_t difference = 0;
};

// The submaps that look most like the searcher's middle place, the likest first, each once. Only
// those for which `may_be` holds are looked at.
std::vector<SubmapCandidate> SearchPlaces(std::span<const SubmapPlaces> submaps,
                                          SubmapPlaces searcher,
                                          const std::function<bool(std::size_t)>& may_be,
                                          const PlaceSearchOptions& options);

}  // namespace atlas
