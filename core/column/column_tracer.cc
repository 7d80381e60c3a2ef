#include "core/column/column_tracer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/integer_math.h"
#include "core/column/half_segments.h"
#include "core/column/polar_misses.h"
#include "core/geometry/nibble.h"

namespace atlas {
namespace {

constexpr std::uint64_t kLowBits = 0x1111'1111'1111'1111;  // of each nibble

// What a scan says about the half segments above each cell of the grid.
struct CellMasks {
  explicit CellMasks(std::size_t cells) : passed(cells), hit(cells) {}

  std::vector<HalfMask> passed;  // by a ray, and nothing was measured in the segment
  std::vector<HalfMask> hit;     // whole segments in which an obstacle was
};

float GroundHeight(const KeyframeCell& cell) {
  return static_cast<float>(cell.altitude_mm) * 1e-3F;
}

// After the rays: where something was measured nothing was passed.
void MarkReturns(const LeveledScan& scan,
                 const RayTable& rays,
                 std::span<const KeyframeCell> cells,
                 const HalfSegments& halves,
                 float base_offset_m,
                 CellMasks& masks) {
  const GridGeometry& grid = rays.grid();
  const float cells_per_m = 1.0F / static_cast<float>(grid.cell_size_m());
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const auto ix = static_cast<std::int32_t>(std::floor(scan.x[i] * cells_per_m));
    const auto iy = static_cast<std::int32_t>(std::floor(scan.y[i] * cells_per_m));
    if (!grid.Contains(ix, iy) || scan.range_m[i] >= rays.radius_m()) {
      continue;
    }
    const std::size_t cell = grid.Index(ix, iy);
    const HalfMask segment = halves.SegmentAt(scan.z[i]);
    masks.passed[cell] &= ~segment;
    const float above_ground_m = scan.z[i] - GroundHeight(cells[cell]);
    if (scan.is_ground[i] == 0 && above_ground_m >= base_offset_m) {
      masks.hit[cell] |= segment;
    }
  }
}

// Poses, the vehicle's motion during a scan and the grid itself blur where obstacles are, and a ray
// that grazes a wall passes the cells beside its own: near a hit segment nothing was passed.
void ProtectNeighbours(const GridGeometry& grid, float blur_m, CellMasks& masks) {
  const std::int32_t side = grid.side();
  const auto reach =
      static_cast<std::int32_t>(std::max(1L, std::lround(blur_m / grid.cell_size_m())));
  for (std::int32_t row = 0; row < side; ++row) {
    for (std::int32_t column = 0; column < side; ++column) {
      const HalfMask hit = masks.hit[static_cast<std::size_t>(row * side + column)];
      if (hit == 0) {
        continue;
      }
      for (std::int32_t y = std::max(0, row - reach); y <= std::min(side - 1, row + reach); ++y) {
        for (std::int32_t x = std::max(0, column - reach); x <= std::min(side - 1, column + reach);
             ++x) {
          masks.passed[static_cast<std::size_t>(y * side + x)] &= ~hit;
        }
      }
    }
  }
}

std::size_t BlockOf(std::int32_t row,
                    std::int32_t column,
                    const GridGeometry& grid,
                    std::int32_t block_cells) {
  const std::int32_t blocks = (grid.side() + block_cells - 1) / block_cells;
  return static_cast<std::size_t>(row / block_cells * blocks + column / block_cells);
}

// Calls visit(block, cell) for all cells of block after block, without a division a cell.
template <typename Visit>
void ForEachCellByBlock(const GridGeometry& grid, std::int32_t block_cells, Visit&& visit) {
  const std::int32_t side = grid.side();
  std::size_t block = 0;
  for (std::int32_t top = 0; top < side; top += block_cells) {
    for (std::int32_t left = 0; left < side; left += block_cells, ++block) {
      for (std::int32_t row = top; row < std::min(side, top + block_cells); ++row) {
        for (std::int32_t column = left; column < std::min(side, left + block_cells); ++column) {
          visit(block, static_cast<std::size_t>(row * side + column));
        }
      }
    }
  }
}

std::vector<std::int16_t> PlaceAnchors(const GridGeometry& grid,
                                       std::span<const KeyframeCell> cells,
                                       const ColumnOptions& options) {
  const std::int32_t side = grid.side();
  const std::int32_t blocks = (side + options.block_cells - 1) / options.block_cells;
  constexpr std::int32_t kNone = std::numeric_limits<std::int32_t>::max();
  std::vector<std::int32_t> lowest_mm(static_cast<std::size_t>(blocks * blocks), kNone);
  ForEachCellByBlock(grid, options.block_cells, [&](std::size_t block, std::size_t cell) {
    if (cells[cell].source != AltitudeSource::kNone) {
      lowest_mm[block] = std::min<std::int32_t>(lowest_mm[block], cells[cell].altitude_mm);
    }
  });
  const auto segment_mm =
      static_cast<std::int64_t>(std::lround(options.segment_height_m * 1000.0F));
  std::vector<std::int16_t> anchors(lowest_mm.size(), 0);
  for (std::size_t i = 0; i < anchors.size(); ++i) {
    if (lowest_mm[i] != kNone) {
      anchors[i] = static_cast<std::int16_t>(FloorDiv(lowest_mm[i], segment_mm));
    }
  }
  return anchors;
}

// The two bits of 16 segments, each moved to the low bits of its own nibble.
std::uint64_t SpreadToNibbles(std::uint64_t pairs) {
  std::uint64_t bits = pairs & 0xFFFF'FFFFULL;
  bits = (bits | (bits << 16)) & 0x0000'FFFF'0000'FFFFULL;
  bits = (bits | (bits << 8)) & 0x00FF'00FF'00FF'00FFULL;
  bits = (bits | (bits << 4)) & 0x0F0F'0F0F'0F0F'0F0FULL;
  return (bits | (bits << 2)) & 0x3333'3333'3333'3333ULL;
}

// The segments, as their lower halves, that rays say are free: those that rays passed in both
// halves. A ray above a bollard says nothing about it. The lower half of the ground's own segment
// is ground.
HalfMask Missed(HalfMask passed, HalfMask ground_segment) {
  return (passed | ground_segment) & (passed >> 1) & kLowerHalves;
}

// The segments from the anchor on.
std::uint64_t LowNibbles(std::uint64_t nibbles, int segments) {
  return segments == 16 ? nibbles : nibbles & ((std::uint64_t{1} << (4 * segments)) - 1);
}

// The low bits of the nibbles that are `state`.
std::uint64_t Equal(std::uint64_t nibbles, std::uint8_t state) {
  const std::uint64_t other = nibbles ^ (state * kLowBits);
  return ~(other | (other >> 1) | (other >> 2) | (other >> 3)) & kLowBits;
}

std::uint64_t ColumnFromMasks(
    HalfMask passed, HalfMask hit, float ground_m, int anchor, const HalfSegments& halves) {
  const HalfMask missed = Missed(passed, halves.SegmentAt(ground_m));
  const std::uint64_t states =
      SpreadToNibbles(halves.From(anchor, (hit & kLowerHalves) | (missed << 1)));
  return (states & kLowBits) * kNibbleHit + ((states >> 1) & kLowBits) * kNibbleMiss;
}

// Marks cells of the vehicle itself: free from the ground to the segment that its top is in,
// whatever was traced there, and nearly so in that one, where the heads of those are that follow.
// Of two places the higher counts.
class BodyMarker {
 public:
  BodyMarker(const GridGeometry& grid,
             const ColumnOptions& options,
             const HalfSegments& halves,
             std::span<const KeyframeCell> cells,
             LocalColumns& result)
      : grid_(grid), options_(options), halves_(halves), cells_(cells), result_(result) {}

  void Mark(std::int32_t ix, std::int32_t iy, float top_m) {
    const std::size_t cell = grid_.Index(ix, iy);
    if (cells_[cell].source == AltitudeSource::kNone) {
      return;
    }
    const int anchor = result_.anchors[BlockOf(iy + grid_.radius_cells, ix + grid_.radius_cells,
                                               grid_, options_.block_cells)];
    const auto nibbles = [&](HalfMask mask) {
      return SpreadToNibbles(halves_.From(anchor, mask)) & kLowBits;
    };
    std::uint64_t& column = result_.columns[cell];
    const std::uint64_t body = nibbles(halves_.Below(top_m));
    const std::uint64_t above =
        nibbles(halves_.SegmentAt(top_m) & kLowerHalves) & ~Equal(column, kNibbleFree);
    column =
        LowNibbles((column & ~((body | above) * 15)) | body * kNibbleFree | above * kNibbleOver,
                   options_.segments);
  }

 private:
  const GridGeometry& grid_;
  const ColumnOptions& options_;
  const HalfSegments& halves_;
  std::span<const KeyframeCell> cells_;
  LocalColumns& result_;
};

}  // namespace

ColumnOptions ColumnOptions::FromProfile(const MapProfile& profile, std::int32_t block_cells) {
  ColumnOptions options;
  options.segments = profile.column_segments;
  options.segment_height_m = static_cast<float>(profile.segment_height_m());
  options.base_offset_m = static_cast<float>(profile.column_base_offset_mm) * 1e-3F;
  options.block_cells = block_cells;
  return options;
}

LocalColumns TraceColumns(const LeveledScan& scan,
                          const RayTable& rays,
                          std::span<const KeyframeCell> cells,
                          const VehiclePlace& here,
                          std::span<const VehiclePlace> trail,
                          const ColumnOptions& options) {
  const float foot_m = GroundHeight(cells[rays.grid().Index(0, 0)]);
  const HalfSegments halves(options.segment_height_m, foot_m);
  PolarMisses misses(rays, halves);
  for (std::size_t i = 0; i < scan.size(); ++i) {
    misses.Add(scan.azimuth_rad[i], scan.range_m[i], scan.z[i]);
  }
  CellMasks masks(cells.size());
  misses.ForEach([&masks](std::uint32_t cell, HalfMask mask) { masks.passed[cell] |= mask; });
  MarkReturns(scan, rays, cells, halves, options.base_offset_m, masks);
  const GridGeometry& grid = rays.grid();
  ProtectNeighbours(grid, options.blur_m, masks);

  LocalColumns result;
  result.anchors = PlaceAnchors(grid, cells, options);
  result.columns.resize(cells.size());
  ForEachCellByBlock(grid, options.block_cells, [&](std::size_t block, std::size_t cell) {
    if (cells[cell].source != AltitudeSource::kNone &&
        (masks.passed[cell] | masks.hit[cell]) != 0) {
      result.columns[cell] =
          LowNibbles(ColumnFromMasks(masks.passed[cell], masks.hit[cell], GroundHeight(cells[cell]),
                                     result.anchors[block], halves),
                     options.segments);
    }
  });
  BodyMarker marker(grid, options, halves, cells, result);
  const auto mark = [&](const VehiclePlace& place) {
    options.body.ForEachCell(grid, place, [&](std::int32_t ix, std::int32_t iy, float, float) {
      marker.Mark(ix, iy, place.sensor_m.z() + options.body.clearance_m);
    });
  };
  for (const VehiclePlace& place : trail) {
    mark(place);
  }
  mark(here);
  return result;
}

}  // namespace atlas
