// Where the columns of a cell's layers stand on the world's lattice of segments, and how high they
// may reach: never into the slab of the layer above (docs/algorithms/fusion.md, "Columns").
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/tile/tile.h"

namespace atlas {

struct ColumnSpan {
  std::int32_t base = 0;   // lattice index of the lowest nibble
  std::uint64_t mask = 0;  // nibbles that may hold data
};

// The span of a layer at `altitude_mm`; `next_altitude_mm` is that of the cell's next layer above,
// or null.
inline ColumnSpan ColumnSpanOf(std::int32_t altitude_mm,
                               const std::int32_t* next_altitude_mm,
                               const MapProfile& profile) {
  const std::int32_t base = ColumnBaseIndex(altitude_mm, profile);
  std::int64_t segments = profile.column_segments;
  if (next_altitude_mm != nullptr) {
    const std::int64_t end = FloorDiv(std::int64_t{*next_altitude_mm} - profile.slab_margin_mm,
                                      profile.segment_height_mm);
    segments = std::clamp<std::int64_t>(end - base, 0, segments);
  }
  return {base, segments == 0 ? 0 : ~std::uint64_t{0} >> (64 - 4 * segments)};
}

// `column`, whose lowest nibble stands at lattice index `base`, as seen from `span`; what lies
// outside is lost.
inline std::uint64_t FitColumn(std::uint64_t column, std::int32_t base, const ColumnSpan& span) {
  const std::int64_t shift = std::int64_t{base} - span.base;
  if (shift >= 16 || shift <= -16) {
    return 0;
  }
  return (shift >= 0 ? column << (4 * shift) : column >> (-4 * shift)) & span.mask;
}

}  // namespace atlas
