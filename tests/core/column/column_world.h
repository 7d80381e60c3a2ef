// A grid of ground and a scan made by hand, and what the traced columns say of places in it.
#pragma once

#include <cmath>
#include <vector>

#include "core/base/integer_math.h"
#include "core/column/column_tracer.h"
#include "core/geometry/nibble.h"
#include "tests/core/support/shape_world.h"

namespace atlas::testing {

inline ColumnOptions WithSegments(int segments, float height_m) {
  ColumnOptions options;
  options.segments = segments;
  options.segment_height_m = height_m;
  return options;
}

class ColumnWorld {
 public:
  explicit ColumnWorld(const ColumnOptions& options = {}, std::int32_t radius_cells = 100)
      : options_(options), rays_(GridGeometry{100'000, radius_cells}) {
    SetGround([](double, double) { return -1.8; });
  }

  // Height of the ground (levelled frame) by the middle of each cell.
  template <typename Height>
  void SetGround(const Height& height) {
    const std::int32_t r = grid().radius_cells;
    cells_.assign(grid().size(), KeyframeCell());
    for (std::int32_t iy = -r; iy < r; ++iy) {
      for (std::int32_t ix = -r; ix < r; ++ix) {
        KeyframeCell& cell = cells_[grid().Index(ix, iy)];
        cell.altitude_mm = static_cast<std::int16_t>(
            std::lround(1000.0 * height((ix + 0.5) * 0.1, (iy + 0.5) * 0.1)));
        cell.occupancy = Occupancy::kFree;
        cell.source = AltitudeSource::kInterpolated;
      }
    }
  }

  void Hit(float x_m, float y_m, float z_m) { AddReturn(scan_, {x_m, y_m, z_m}, false); }
  void Ground(float x_m, float y_m, float z_m) { AddReturn(scan_, {x_m, y_m, z_m}, true); }
  // Rays along the x axis to a far wall: one every centimetre of its height.
  void FarWall(float low_m, float high_m) {
    for (const float z_m : Steps(low_m, high_m, 0.01F)) {
      Hit(9.0F, 0.05F, z_m);
    }
  }

  // The vehicle stood there before.
  void Trail(const VehiclePlace& place) { trail_.push_back(place); }

  void Trace() { result_ = TraceColumns(scan_, rays_, cells_, {}, trail_, options_); }

  const GridGeometry& grid() const { return rays_.grid(); }
  const LocalColumns& result() const { return result_; }
  std::vector<KeyframeCell>& cells() { return cells_; }
  LeveledScan& scan() { return scan_; }
  const ColumnOptions& options() const { return options_; }

  static std::int32_t CellOf(double metres) {
    return static_cast<std::int32_t>(std::floor(metres / 0.1));
  }
  int AnchorOf(std::int32_t ix, std::int32_t iy) const {
    const std::int32_t blocks = (grid().side() + options_.block_cells - 1) / options_.block_cells;
    const std::int32_t row = (iy + grid().radius_cells) / options_.block_cells;
    const std::int32_t column = (ix + grid().radius_cells) / options_.block_cells;
    return result_.anchors[static_cast<std::size_t>(row * blocks + column)];
  }
  // State of the segment at height z; -1 outside the column.
  int State(double x_m, double y_m, double z_m) const {
    const std::int32_t ix = CellOf(x_m);
    const std::int32_t iy = CellOf(y_m);
    const int segment =
        static_cast<int>(std::floor(z_m / double{options_.segment_height_m})) - AnchorOf(ix, iy);
    return segment < 0 || segment >= options_.segments
               ? -1
               : NibbleAt(result_.columns[grid().Index(ix, iy)], segment);
  }

 private:
  ColumnOptions options_;
  RayTable rays_;
  std::vector<KeyframeCell> cells_;
  LeveledScan scan_;
  std::vector<VehiclePlace> trail_;
  LocalColumns result_;
};

}  // namespace atlas::testing
