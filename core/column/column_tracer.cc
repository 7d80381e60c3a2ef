#include "core/column/column_tracer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/integer_math.h"
#include "core/geometry/nibble.h"

namespace atlas {
namespace {

// Segments as bits of one word: index k of the levelled frame is bit k + kOrigin.
using SegmentMask = std::uint64_t;
constexpr int kOrigin = 32;
constexpr int kMaskBits = 64;

bool IsInMask(int segment) {
  return segment >= -kOrigin && segment < kMaskBits - kOrigin;
}
SegmentMask Bit(int segment) {
  return SegmentMask{1} << (segment + kOrigin);
}

// The segments that rays passed above each step of each azimuth.
class PolarMisses {
 public:
  PolarMisses(const RayTable& rays, float segment_height_m)
      : rays_(rays),
        segment_height_m_(segment_height_m),
        masks_(static_cast<std::size_t>(rays.rays()) * static_cast<std::size_t>(rays.steps())),
        reach_(static_cast<std::size_t>(rays.rays())) {}

  // A ray from the sensor to a return at horizontal distance `range_m` and height `z_m`; it ends a
  // cell before the return.
  void Add(float azimuth_rad, float range_m, float z_m) {
    const int ray = rays_.Ray(azimuth_rad);
    const float cell_m = static_cast<float>(rays_.grid().cell_size_m());
    const float end_m = std::min(range_m - cell_m, rays_.radius_m());
    const int end = std::min(rays_.steps(), static_cast<int>(end_m / rays_.step_m()));
    if (end <= 0) {
      return;
    }
    int& reach = reach_[static_cast<std::size_t>(ray)];
    reach = std::max(reach, end);
    Fill(masks_.data() + static_cast<std::size_t>(ray) * static_cast<std::size_t>(rays_.steps()),
         end, z_m / range_m);
  }

  // Calls visit(cell, mask) for every step that was passed.
  template <typename Visit>
  void ForEach(Visit&& visit) const {
    for (int ray = 0; ray < rays_.rays(); ++ray) {
      const SegmentMask* masks =
          masks_.data() + static_cast<std::size_t>(ray) * static_cast<std::size_t>(rays_.steps());
      const std::uint32_t* cells = rays_.Cells(ray);
      for (int step = 0; step < reach_[static_cast<std::size_t>(ray)]; ++step) {
        visit(cells[step], masks[step]);
      }
    }
  }

 private:
  // The ray rises (or falls) through one segment after the other.
  void Fill(SegmentMask* masks, int end, float slope) const {
    const float segments_per_step = slope * rays_.step_m() / segment_height_m_;
    const int direction = slope < 0.0F ? -1 : 1;
    const float steps_per_segment =
        std::abs(segments_per_step) > 1e-6F ? 1.0F / std::abs(segments_per_step) : 1e9F;
    int segment = slope < 0.0F ? -1 : 0;  // the sensor is on the border between these two
    float border = steps_per_segment;     // in steps from the sensor
    for (int begin = 0; begin < end && IsInMask(segment); segment += direction) {
      const int stop = border < static_cast<float>(end) ? static_cast<int>(border) : end;
      const SegmentMask bit = Bit(segment);
      for (int step = begin; step < stop; ++step) {
        masks[step] |= bit;
      }
      begin = stop;
      border += steps_per_segment;
    }
  }

  const RayTable& rays_;
  float segment_height_m_;
  std::vector<SegmentMask> masks_;
  std::vector<int> reach_;  // steps in use, by ray
};

struct CellMasks {
  SegmentMask miss = 0;
  SegmentMask surface = 0;  // anything was measured here
  SegmentMask hit = 0;      // an obstacle was
};

void MarkReturns(const LeveledScan& scan,
                 const RayTable& rays,
                 std::span<const KeyframeCell> cells,
                 const ColumnOptions& options,
                 std::vector<CellMasks>& masks) {
  const GridGeometry& grid = rays.grid();
  const float cells_per_m = 1.0F / static_cast<float>(grid.cell_size_m());
  const float segments_per_m = 1.0F / options.segment_height_m;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const auto ix = static_cast<std::int32_t>(std::floor(scan.x[i] * cells_per_m));
    const auto iy = static_cast<std::int32_t>(std::floor(scan.y[i] * cells_per_m));
    const int segment = static_cast<int>(std::floor(scan.z[i] * segments_per_m));
    if (!grid.Contains(ix, iy) || scan.range_m[i] >= rays.radius_m() || !IsInMask(segment)) {
      continue;
    }
    const std::size_t cell = grid.Index(ix, iy);
    masks[cell].surface |= Bit(segment);
    const float above_ground_m = scan.z[i] - static_cast<float>(cells[cell].altitude_mm) * 1e-3F;
    if (scan.is_ground[i] == 0 && above_ground_m >= options.base_offset_m) {
      masks[cell].hit |= Bit(segment);
    }
  }
}

// Obstacles are where they are to within a cell: poses, the vehicle's motion during a scan and the
// grid itself blur them, and a ray that grazes a wall passes the cells beside its own. So a segment
// next to a hit one is not missed either.
void ProtectNeighbours(const GridGeometry& grid, std::vector<CellMasks>& masks) {
  const auto side = static_cast<std::size_t>(grid.side());
  std::vector<SegmentMask> widened(masks.size(), 0);
  for (std::size_t i = 1; i + 1 < masks.size(); ++i) {
    widened[i] = masks[i - 1].hit | masks[i].hit | masks[i + 1].hit;
  }
  for (std::size_t i = side; i + side < masks.size(); ++i) {
    masks[i].surface |= widened[i - side] | widened[i] | widened[i + side];
  }
}

std::vector<std::int16_t> PlaceAnchors(const GridGeometry& grid,
                                       std::span<const KeyframeCell> cells,
                                       const ColumnOptions& options) {
  const std::int32_t side = grid.side();
  const std::int32_t blocks = (side + options.block_cells - 1) / options.block_cells;
  constexpr std::int32_t kNone = std::numeric_limits<std::int32_t>::max();
  std::vector<std::int32_t> lowest_mm(static_cast<std::size_t>(blocks * blocks), kNone);
  for (std::int32_t row = 0; row < side; ++row) {
    for (std::int32_t column = 0; column < side; ++column) {
      const KeyframeCell& cell = cells[static_cast<std::size_t>(row * side + column)];
      if (cell.source != AltitudeSource::kNone) {
        std::int32_t& lowest = lowest_mm[static_cast<std::size_t>(
            row / options.block_cells * blocks + column / options.block_cells)];
        lowest = std::min<std::int32_t>(lowest, cell.altitude_mm);
      }
    }
  }
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

// The low 16 bits, each moved to the low bit of its own nibble.
std::uint64_t SpreadToNibbles(std::uint64_t bits) {
  bits = (bits | (bits << 24)) & 0x000000FF000000FFULL;
  bits = (bits | (bits << 12)) & 0x000F000F000F000FULL;
  bits = (bits | (bits << 6)) & 0x0303030303030303ULL;
  return (bits | (bits << 3)) & 0x1111111111111111ULL;
}

std::uint64_t ColumnFromMasks(const CellMasks& masks, int anchor, int segments) {
  const int shift = anchor + kOrigin;
  if (shift < 0 || shift >= kMaskBits) {
    return 0;
  }
  const std::uint64_t window = (std::uint64_t{1} << segments) - 1;
  const std::uint64_t hit = (masks.hit >> shift) & window;
  const std::uint64_t miss = ((masks.miss & ~masks.surface) >> shift) & window;
  return SpreadToNibbles(hit) * kNibbleHit + SpreadToNibbles(miss) * kNibbleMiss;
}

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
                          const ColumnOptions& options) {
  PolarMisses misses(rays, options.segment_height_m);
  for (std::size_t i = 0; i < scan.size(); ++i) {
    misses.Add(scan.azimuth_rad[i], scan.range_m[i], scan.z[i]);
  }
  std::vector<CellMasks> masks(cells.size());
  misses.ForEach([&masks](std::uint32_t cell, SegmentMask mask) { masks[cell].miss |= mask; });
  MarkReturns(scan, rays, cells, options, masks);
  ProtectNeighbours(rays.grid(), masks);

  const GridGeometry& grid = rays.grid();
  LocalColumns result;
  result.anchors = PlaceAnchors(grid, cells, options);
  result.columns.resize(cells.size());
  const std::int32_t side = grid.side();
  const std::int32_t blocks = (side + options.block_cells - 1) / options.block_cells;
  for (std::int32_t row = 0; row < side; ++row) {
    for (std::int32_t column = 0; column < side; ++column) {
      const auto cell = static_cast<std::size_t>(row * side + column);
      if (cells[cell].source != AltitudeSource::kNone) {
        const auto block = static_cast<std::size_t>(row / options.block_cells * blocks +
                                                    column / options.block_cells);
        result.columns[cell] =
            ColumnFromMasks(masks[cell], result.anchors[block], options.segments);
      }
    }
  }
  return result;
}

}  // namespace atlas
