// One level-0 tile's place of a map window, prepared for matching once: what stands in it as
// vertical lines, what can be driven as planes. Around it, it asks the places beside it.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/map_profile.h"
#include "core/localization/window/closed_masks.h"
#include "core/localization/window/column_line.h"
#include "core/localization/window/occupied_rows.h"
#include "core/localization/window/place_content.h"
#include "core/tile/tile.h"

namespace atlas {

// A surface layer at a cell: z = z_m + gradient . ((x, y) - cell centre).
struct SurfacePlane {
  float z_m = 0.0F;
  Eigen::Vector2f gradient = Eigen::Vector2f::Zero();
};

// Where a point is over a surface.
struct SurfaceBelow {
  SurfacePlane plane;
  float height_m = 0.0F;  // of the point above it
};

struct PlaceOptions {
  ContentOptions content;
  ColumnLineOptions lines;
  float slope_baseline_m = 1.0F;  // either way, over which the ground's gradient is taken
};

// Points and lines are counted from the place's lowest corner and from segment 0. For one thread at
// a time: lines are fitted when they are first asked for.
class WindowPlace {
 public:
  // Itself in the middle, row-major, the lowest first; null where the window has nothing.
  using Nine = std::array<const WindowPlace*, 9>;

  // What it holds. `serial`, not 0, names it among all that a window has read.
  void Read(const std::shared_ptr<const Tile>& tile,
            const TileId& place,
            const MapProfile& profile,
            std::int64_t first_segment,
            const ContentOptions& options,
            std::uint64_t serial);
  // Nothing: there is no tile.
  void ReadNothing(std::uint64_t serial);
  // Whether it was read from `tile`, for `first_segment`; null: from none.
  bool IsOf(const std::shared_ptr<const Tile>& tile, std::int64_t first_segment) const;

  // What stands around it; nothing is done where that is what it was linked with. All of `around`
  // stay where they are until it is linked again. `scratch` may be anything.
  void Link(const Nine& around,
            const MapProfile& profile,
            const PlaceOptions& options,
            ClosedMasks& scratch);

  const PlaceContent& content() const { return content_; }
  const OccupiedRows& rows() const { return rows_; }
  int level() const { return level_; }  // of the tile that it was read from
  std::uint64_t serial() const { return serial_; }

  // All require Link().
  //
  // The line nearest to `p` in `segment`, within `radius_m` (OccupiedRows).
  std::optional<ColumnLine> NearestLine(const Eigen::Vector2f& p,
                                        int segment,
                                        float radius_m) const;
  // The surface nearest to `p` in its `cell`, if one is within `reach_m`.
  std::optional<SurfaceBelow> NearestSurface(const Eigen::Vector3f& p,
                                             WindowCell cell,
                                             float reach_m) const;

 private:
  const WindowPlace* PlaceOf(WindowCell& cell) const;
  bool IsFree(WindowCell cell, int segment) const;
  Eigen::Vector2f CenterOf(WindowCell cell) const;
  const ColumnLine& LineAt(WindowCell cell, int segment) const;
  ColumnLine FitLine(WindowCell cell, int segment) const;
  void FindFreeSide(int segment, ColumnLine& line) const;
  Eigen::Vector2f GradientAt(WindowCell cell, float z_m) const;
  std::optional<float> SurfaceNear(WindowCell cell, float z_m) const;

  std::uint64_t serial_ = 0;
  std::weak_ptr<const Tile> tile_;
  std::int64_t first_segment_ = 0;
  std::uint8_t level_ = 0;
  PlaceContent content_;

  std::array<std::uint64_t, 9> linked_{};  // serials
  Nine around_{};
  OccupiedRows rows_;
  mutable std::vector<std::optional<ColumnLine>> lines_;  // by rank; a scan sees few of them
  ColumnLineOptions line_options_;
  std::int32_t cells_ = 0;
  std::int32_t baseline_cells_ = 1;
  float cell_size_m_ = 0.0F;
};

}  // namespace atlas
