// A keyframe's observations of the cells of a tile: inverse nearest resampling, so that a keyframe
// says at most one thing about a cell, and the same whichever tile asks.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/integer_math.h"
#include "core/fusion/observation/disc.h"
#include "core/fusion/observation/frame_on_map.h"
#include "core/fusion/observation/observation.h"
#include "core/fusion/observation/sigma_table.h"
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

  // Calls visit(cell, observation) for the cells of the band that the keyframe saw, and for those
  // of a row expect(cell) before: the one chance to have their memory fetched in time. Cells count
  // row by row from the band's first one.
  template <typename Expect, typename Visitor>
  void Visit(const TileBand& band, const Expect& expect, const Visitor& visit) const;

 private:
  static constexpr int kFineBits = 31;    // of u and v, in cells
  static constexpr int kCoarseBits = 16;  // enough for distances, and their squares fit in 64 bits

  // Cells of one row, from `begin` up to `end`, that lie inside the disc.
  struct RowSpan {
    std::int64_t begin = 0;
    std::int64_t end = 0;
  };
  RowSpan DiscSpan(std::int64_t j, std::int64_t first_i, std::int64_t cells) const;

  // A cell of the map that lies inside the disc.
  struct Place {
    std::uint32_t cell = 0;   // of the band
    std::uint32_t index = 0;  // of the keyframe's cell
    std::uint32_t d2 = 0;     // squared distance from the sensor, cells
    std::int16_t ix = 0;      // of the keyframe's cell
    std::int16_t iy = 0;
  };
  static constexpr std::size_t kMaxRowCells = 256;  // MapProfile's largest tile
  using Row = std::array<Place, kMaxRowCells>;
  // Fills `row` with the places of row `y` of the band; returns their number.
  std::size_t FindPlaces(const TileBand& band, std::int32_t y, Row& row) const;
  // False when the cell was not seen.
  bool Observe(const Place& place, Observation& out) const;
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
  std::int32_t level_mm_;       // the sensor's altitude, if so
  std::int32_t level_lattice_;  // of the sensor, if so
};

// Inline: these run once for every cell that every keyframe saw.
inline bool FrameResampler::Observe(const Place& place, Observation& out) const {
  const KeyframeCell& seen = keyframe_.cells[place.index];
  if (seen.source == AltitudeSource::kNone) {
    return false;
  }
  std::int32_t sensor_mm = level_mm_;
  if (!is_level_) {
    const std::int64_t slope_half_cells = std::int64_t{placement_.slope_x} * (2 * place.ix + 1) +
                                          std::int64_t{placement_.slope_y} * (2 * place.iy + 1);
    const std::int64_t tilt_um = (slope_half_cells * cell_size_um_) >> kFineBits;
    sensor_mm = static_cast<std::int32_t>(RoundDiv(placement_.z_um + tilt_um, 1000));
  }
  out.altitude_mm = sensor_mm + seen.altitude_mm;
  out.column = keyframe_.columns[place.index] & column_mask_;
  if (out.column != 0) {
    out.column_base = (is_level_ ? level_lattice_ : NearestLattice(sensor_mm)) +
                      keyframe_.anchors[keyframe_.BlockIndex(place.ix, place.iy)];
  }
  out.distance_step = sigmas_.Step(place.d2);
  out.source = seen.source;
  out.occupancy = seen.occupancy;
  return true;
}

template <typename Expect, typename Visitor>
void FrameResampler::Visit(const TileBand& band, const Expect& expect, const Visitor& visit) const {
  Row row;
  Observation observation;
  for (std::int32_t y = 0; y < band.rows; ++y) {
    const std::size_t count = FindPlaces(band, y, row);
    for (std::size_t i = 0; i < count; ++i) {
      __builtin_prefetch(&keyframe_.cells[row[i].index]);
      __builtin_prefetch(&keyframe_.columns[row[i].index]);
      expect(row[i].cell);
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (Observe(row[i], observation)) {
        visit(row[i].cell, observation);
      }
    }
  }
}

}  // namespace atlas
