// A tile of the atlas, decoded: for each cell its surface layers, lowest first, with the nibble
// column that stands on each (paper III-C, III-D).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/integer_math.h"
#include "core/geometry/keyframe_key.h"
#include "core/geometry/map_profile.h"
#include "core/geometry/tile_id.h"

namespace atlas {

struct TileLayer {
  // Frozen bits of `flags`.
  static constexpr std::uint8_t kTraversable = 1;     // every level-0 cell below is free
  static constexpr std::uint8_t kTraversableAny = 2;  // at least one level-0 cell below is free
  static constexpr std::uint8_t kMeasured = 4;        // ground was measured or interpolated here

  std::int32_t altitude_mm = 0;  // world frame
  // Standard deviation of the altitude, units of 0.1 mm, rounded as sigma_code.h says.
  std::uint16_t sigma_100um = 0;
  std::int8_t occupancy = 0;  // evidence of an obstacle, units of ln(9)/64 (nibble.h)
  std::uint8_t flags = 0;
  std::uint16_t observations = 0;  // keyframes that saw it, saturating
  std::uint32_t confirmed_s = 0;   // seconds since 1970 when a keyframe saw it last
  std::uint64_t column = 0;        // nibbles, lowest segment first; 0 = no data

  bool is_traversable() const { return (flags & kTraversable) != 0; }

  friend bool operator==(const TileLayer&, const TileLayer&) = default;
};

// No layer lies higher or lower: poses end at 20 km (pose.h), and a keyframe reaches less than 100
// m above and below. Whoever reads a tile may subtract.
inline constexpr std::int32_t kMaxAltitude_mm = 25'000'000;

// No cell holds more layers: a bound on what hostile vehicles can make of a tile. Where more are
// found, those with the most observations stay, the lower one of two equals.
inline constexpr std::size_t kMaxCellLayers = 16;

// Columns stand on the world's lattice of multiples of the segment height; the lowest segment is
// the one that holds altitude + base offset. A function of the altitude, so it is never stored.
inline std::int32_t ColumnBaseIndex(std::int32_t altitude_mm, const MapProfile& profile) {
  return static_cast<std::int32_t>(FloorDiv(
      std::int64_t{altitude_mm} + profile.column_base_offset_mm, profile.segment_height_mm));
}

struct Tile {
  TileId id;
  std::vector<SessionKey> contributors;   // sorted
  std::vector<std::uint32_t> cell_begin;  // tile_cells^2 + 1 offsets into layers, row-major
  std::vector<TileLayer> layers;          // by cell, lowest first within a cell

  bool is_empty() const { return layers.empty(); }
  std::span<const TileLayer> Layers(std::size_t cell) const {
    return std::span(layers).subspan(cell_begin[cell], cell_begin[cell + 1] - cell_begin[cell]);
  }

  friend bool operator==(const Tile&, const Tile&) = default;
};

// A tile with `profile.tile_cells` squared cells and no layer.
Tile EmptyTile(const TileId& id, const MapProfile& profile);

}  // namespace atlas
