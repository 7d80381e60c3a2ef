// The occupied segments of a place and of a border around it, with the gaps in structure closed
// that no ray crossed.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/localization/window/place_content.h"

namespace atlas {

// A place in the middle of the eight around it, row-major, the lowest first; null or empty where
// nothing is known.
using NineContents = std::array<const PlaceContent*, 9>;

class ClosedMasks {
 public:
  // Of the border of a place of so many cells a side: what its neighbours alone say about it.
  static std::int32_t Border(std::int32_t cells);

  // For OccupiedRows, whose border is Border(cells); valid until the next call. The same whatever
  // is known beyond the nine.
  std::span<const std::uint64_t> Of(const NineContents& nine,
                                    std::int32_t cells,
                                    float cell_size_m);

 private:
  void Gather(const NineContents& nine, std::int32_t cells, std::int32_t margin);
  void CloseGaps(std::ptrdiff_t reach);

  std::ptrdiff_t side_ = 0;  // with the border and what closing its gaps takes
  std::vector<std::uint64_t> occupied_;
  std::vector<std::uint64_t> free_;
  std::vector<std::uint64_t> closed_;
};

}  // namespace atlas
