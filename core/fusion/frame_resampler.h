// A keyframe's observations of the cells of a tile: inverse nearest resampling, so that a keyframe
// says at most one thing about a cell, and the same whichever tile asks.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "core/base/integer_math.h"
#include "core/fusion/disc.h"
#include "core/fusion/observation.h"
#include "core/fusion/sigma_table.h"
#include "core/fusion/tile_fusion.h"
#include "core/keyframe/keyframe.h"

namespace atlas {

// Rows first_row .. first_row + rows - 1 of a level-0 tile.
struct TileBand {
  TileId id;
  std::int32_t first_row = 0;
  std::int32_t rows = 0;
};

class FrameResampler {
 public:
  // All must outlive the resampler.
  FrameResampler(const FrameOnMap& frame,
                 const Keyframe& keyframe,
                 const SigmaTable& sigmas,
                 const MapProfile& profile);

  // Calls visit(cell, observation) for the cells of the band that the keyframe saw; cells count
  // row by row from the band's first one.
  template <typename Visitor>
  void Visit(const TileBand& band, Visitor&& visit) const;

 private:
  static constexpr int kFineBits = 31;    // of u and v, in cells
  static constexpr int kCoarseBits = 16;  // enough for distances, and their squares fit in 64 bits

  // Cells of one row, from `begin` up to `end`, that lie inside the disc.
  struct RowSpan {
    std::int64_t begin = 0;
    std::int64_t end = 0;
  };
  RowSpan DiscSpan(std::int64_t j, std::int64_t first_i, std::int64_t cells) const;
  // False when the cell was not seen. Requires a point inside the disc, cells x 2^16.
  bool Observe(std::int64_t u_q16, std::int64_t v_q16, Observation& out) const;
  std::int32_t NearestLattice(std::int32_t z_mm) const {
    return static_cast<std::int32_t>(RoundDiv(z_mm, segment_height_mm_));
  }

  const Keyframe& keyframe_;
  const SigmaTable& sigmas_;
  const KeyframePlacement placement_;
  std::int64_t cell_size_um_;
  std::int64_t segment_height_mm_;
  std::int32_t tile_cells_;
  std::uint64_t column_mask_;
  std::int64_t u_origin_;
  std::int64_t v_origin_;
  std::int64_t limit_q32_;      // squared radius
  bool is_level_;               // no residual tilt
  std::int32_t level_lattice_;  // of the sensor, if so
};

// Inline: it runs once for every cell that every keyframe saw.
inline bool FrameResampler::Observe(std::int64_t u_q16,
                                    std::int64_t v_q16,
                                    Observation& out) const {
  const auto ix = static_cast<std::int32_t>(u_q16 >> kCoarseBits);
  const auto iy = static_cast<std::int32_t>(v_q16 >> kCoarseBits);
  const std::size_t index = keyframe_.grid.Index(ix, iy);
  const KeyframeCell& seen = keyframe_.cells[index];
  if (seen.source == AltitudeSource::kNone) {
    return false;
  }
  std::int64_t z_um = placement_.z_um;
  if (!is_level_) {
    const std::int64_t slope_half_cells = std::int64_t{placement_.slope_x} * (2 * ix + 1) +
                                          std::int64_t{placement_.slope_y} * (2 * iy + 1);
    z_um += (slope_half_cells * cell_size_um_) >> kFineBits;
  }
  // Rounded with the cell's own altitude, a whole number of millimetres: the same for every cell.
  const auto sensor_mm = static_cast<std::int32_t>(RoundDiv(z_um, 1000));
  out.altitude_mm = sensor_mm + seen.altitude_mm;
  out.column = keyframe_.columns[index] & column_mask_;
  if (out.column != 0) {
    out.column_base = (is_level_ ? level_lattice_ : NearestLattice(sensor_mm)) +
                      keyframe_.anchors[keyframe_.BlockIndex(ix, iy)];
  }
  const std::int64_t d2 = (u_q16 * u_q16 + v_q16 * v_q16) >> (2 * kCoarseBits);
  out.distance_step = sigmas_.Step(static_cast<std::size_t>(d2));
  out.source = seen.source;
  out.occupancy = seen.occupancy;
  return true;
}

template <typename Visitor>
void FrameResampler::Visit(const TileBand& band, Visitor&& visit) const {
  constexpr int kShift = kFineBits - kCoarseBits;
  const std::int64_t first_i = std::int64_t{band.id.x} * tile_cells_;
  const std::int64_t first_j = std::int64_t{band.id.y} * tile_cells_ + band.first_row;
  const std::int64_t cos = placement_.cos_yaw;
  const std::int64_t sin = placement_.sin_yaw;
  Observation observation;
  for (std::int32_t y = 0; y < band.rows; ++y) {
    const std::int64_t j = first_j + y;
    const RowSpan row = DiscSpan(j, first_i, tile_cells_);
    // The centre of cell (i, j) is at (2 i + 1, 2 j + 1) half cells.
    std::int64_t u = cos * (2 * row.begin + 1) + sin * (2 * j + 1) - u_origin_;
    std::int64_t v = cos * (2 * j + 1) - sin * (2 * row.begin + 1) - v_origin_;
    auto cell = static_cast<std::size_t>(y * std::int64_t{tile_cells_} + row.begin - first_i);
    for (std::int64_t i = row.begin; i < row.end; ++i) {
      const std::int64_t u_q16 = u >> kShift;
      const std::int64_t v_q16 = v >> kShift;
      if (u_q16 * u_q16 + v_q16 * v_q16 < limit_q32_ && Observe(u_q16, v_q16, observation)) {
        visit(cell, observation);
      }
      ++cell;
      u += 2 * cos;
      v -= 2 * sin;
    }
  }
}

}  // namespace atlas
