#include "core/localization/window/map_window.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/geometry/nibble.h"

namespace atlas {
namespace {

struct Corner {
  std::int64_t x;
  std::int64_t y;
};

// Whether a square of cells touches the window's [0, side)^2. Tiles elsewhere may be so far that 32
// bits would bring their cells back.
bool Overlaps(const Corner& first, std::int64_t length, std::int64_t side) {
  return first.x > -length && first.x < side && first.y > -length && first.y < side;
}

bool IsMeasured(const TileLayer& layer) {
  return (layer.flags & TileLayer::kMeasured) != 0;
}

// A cell has one layer for each ground, and what stands on another ground than its own may be left
// out of it: a wall between two ramps has holes. A gap of kGap_m across which structure stands on
// both sides is structure, unless rays crossed it.
void CloseGaps(const WindowGrid& grid, SegmentMasks& masks) {
  constexpr float kGap_m = 0.25F;
  const std::ptrdiff_t side = grid.side();
  const auto reach =
      static_cast<std::ptrdiff_t>(std::clamp(kGap_m / grid.cell_size_m(), 1.0F, 4.0F));
  const std::vector<std::uint64_t> occupied = masks.occupied;
  const auto fill = [&](std::ptrdiff_t cell, std::ptrdiff_t step) {
    for (std::ptrdiff_t length = 2; length <= 2 * reach; ++length) {
      const std::uint64_t both = occupied[static_cast<std::size_t>(cell)] &
                                 occupied[static_cast<std::size_t>(cell + length * step)];
      for (std::ptrdiff_t k = std::max<std::ptrdiff_t>(1, length - reach);
           both != 0 && k <= std::min(reach, length - 1); ++k) {
        const auto between = static_cast<std::size_t>(cell + k * step);
        masks.occupied[between] |= both & ~masks.free[between];
      }
    }
  };
  const std::ptrdiff_t margin = 2 * reach;
  for (std::ptrdiff_t y = 0; y < side - margin; ++y) {
    for (std::ptrdiff_t x = margin; x < side - margin; ++x) {
      const std::ptrdiff_t cell = y * side + x;
      if (occupied[static_cast<std::size_t>(cell)] == 0) {
        continue;
      }
      for (const std::ptrdiff_t step : {std::ptrdiff_t{1}, side, side + 1, side - 1}) {
        fill(cell, step);
      }
    }
  }
}

}  // namespace

// What the tiles hold of a window.
struct MapWindow::Content {
  SegmentMasks masks;
  std::vector<std::pair<std::uint32_t, float>> surfaces;  // by cell and height

  void AddColumn(const TileLayer& layer,
                 std::size_t cell,
                 const WindowGrid& grid,
                 const MapProfile& profile,
                 const MapWindowOptions& options) {
    const std::int64_t base = ColumnBaseIndex(layer.altitude_mm, profile) - grid.first_segment();
    for (int k = 0; k < profile.column_segments; ++k) {
      const std::int64_t bit = base + k;
      const std::uint8_t nibble = NibbleAt(layer.column, k);
      if (nibble == 0 || bit < 0 || bit >= WindowGrid::kSegments) {
        continue;
      }
      if (nibble >= options.occupied_nibble) {
        masks.occupied[cell] |= std::uint64_t{1} << bit;
      } else if (nibble <= options.free_nibble) {
        masks.free[cell] |= std::uint64_t{1} << bit;
      }
    }
  }

  void AddCell(std::span<const TileLayer> layers,
               std::size_t cell,
               const WindowGrid& grid,
               const MapProfile& profile,
               const MapWindowOptions& options) {
    const bool is_any_measured = std::any_of(layers.begin(), layers.end(), IsMeasured);
    for (const TileLayer& layer : layers) {
      if (is_any_measured && !IsMeasured(layer)) {
        continue;  // what stands there does so at a guessed height
      }
      if (layer.is_traversable() && IsMeasured(layer)) {
        surfaces.emplace_back(static_cast<std::uint32_t>(cell),
                              static_cast<float>(layer.altitude_mm * 1e-3 - grid.origin().z()));
      }
      AddColumn(layer, cell, grid, profile, options);
    }
  }
};

MapWindow::Content MapWindow::Collect(const WindowGrid& grid,
                                      const MapProfile& profile,
                                      std::span<const Tile* const> tiles,
                                      const MapWindowOptions& options) {
  Content content;
  content.masks.occupied.assign(grid.size(), 0);
  content.masks.free.assign(grid.size(), 0);
  for (const Tile* tile : tiles) {
    const std::int64_t left = std::int64_t{tile->id.x} * profile.tile_cells - grid.first_x();
    const std::int64_t low = std::int64_t{tile->id.y} * profile.tile_cells - grid.first_y();
    if (!Overlaps({left, low}, profile.tile_cells, grid.side())) {
      continue;
    }
    for (std::int32_t j = 0; j < profile.tile_cells; ++j) {
      for (std::int32_t i = 0; i < profile.tile_cells; ++i) {
        const WindowCell cell{static_cast<std::int32_t>(left + i),
                              static_cast<std::int32_t>(low + j)};
        if (grid.Contains(cell)) {
          content.AddCell(tile->Layers(static_cast<std::size_t>(j * profile.tile_cells + i)),
                          grid.Index(cell), grid, profile, options);
        }
      }
    }
  }
  CloseGaps(grid, content.masks);
  return content;
}

MapWindow::MapWindow(const MapProfile& profile,
                     std::span<const Tile* const> tiles,
                     const Eigen::Vector3d& center,
                     double radius_m,
                     const MapWindowOptions& options)
    : MapWindow(profile,
                WindowGrid(profile, center, radius_m),
                Collect(WindowGrid(profile, center, radius_m), profile, tiles, options),
                options) {}

MapWindow::MapWindow(const MapProfile& profile,
                     const WindowGrid& grid,
                     Content content,
                     const MapWindowOptions& options)
    : grid_(grid),
      slab_m_(static_cast<float>(profile.slab_margin_mm) * 1e-3F),
      columns_(grid_, std::move(content.masks), options.lines),
      surfaces_(grid_, content.surfaces, options.slope_baseline_m) {}

bool MapWindow::IsMapped(const Eigen::Vector3f& p) const {
  const WindowCell cell = grid_.CellAt(p.head<2>());
  return grid_.Contains(cell) && !surfaces_.Of(grid_.Index(cell)).empty();
}

bool MapWindow::IsFree(const Eigen::Vector3f& p) const {
  constexpr float kReach_m = 0.1F;  // what stands at a segment's edge may be counted beside it
  const WindowCell cell = grid_.CellAt(p.head<2>());
  const int lower = grid_.SegmentAt(p.z() - kReach_m);
  const int upper = grid_.SegmentAt(p.z() + kReach_m);
  if (!grid_.Contains(cell) || lower < 0 || upper < 0) {
    return false;
  }
  const std::size_t index = grid_.Index(cell);
  const auto surfaces = surfaces_.Of(index);
  return columns_.IsFree(index, lower) && columns_.IsFree(index, upper) &&
         std::none_of(surfaces.begin(), surfaces.end(), [&](float surface_z_m) {
           return p.z() < surface_z_m && p.z() > surface_z_m - slab_m_;
         });
}

bool MapWindow::IsOccupied(const Eigen::Vector3f& p) const {
  const int segment = grid_.SegmentAt(p.z());
  const WindowCell cell = grid_.CellAt(p.head<2>());
  return segment >= 0 && grid_.Contains(cell) && columns_.IsOccupied(grid_.Index(cell), segment);
}

PointPresence MapWindow::PresenceAt(const Eigen::Vector3f& p, const CellKernel& kernel) const {
  PointPresence presence;
  const int segment = grid_.SegmentAt(p.z());
  const float cells_a_m = 1.0F / grid_.cell_size_m();
  const Eigen::Vector2f place = p.head<2>() * cells_a_m;
  const Eigen::Vector2f corner = place.array().floor();
  const WindowCell cell{static_cast<std::int32_t>(corner.x()),
                        static_cast<std::int32_t>(corner.y())};
  const bool is_within =
      cell.x > 0 && cell.y > 0 && cell.x < grid_.side() - 1 && cell.y < grid_.side() - 1;
  if (segment < 0 || !is_within) {
    return presence;
  }
  const CellKernel::Shares& x = kernel.At(place.x() - corner.x());
  const CellKernel::Shares& y = kernel.At(place.y() - corner.y());
  for (std::size_t row = 0; row < 3; ++row) {
    const unsigned cells =
        columns_.rows().Three({cell.x - 1, cell.y - 1 + static_cast<std::int32_t>(row)}, segment);
    const CellKernel::Share& along = x[cells];
    const CellKernel::Share& across = y[std::size_t{1} << row];
    presence.value += along.value * across.value;
    presence.gradient.x() += along.slope * across.value;
    presence.gradient.y() += along.value * across.slope;
    presence.curve_xx += along.curve * across.value;
    presence.curve_xy += along.slope * across.slope;
    presence.curve_yy += along.value * across.curve;
  }
  presence.gradient *= cells_a_m;
  presence.curve_xx *= cells_a_m * cells_a_m;
  presence.curve_xy *= cells_a_m * cells_a_m;
  presence.curve_yy *= cells_a_m * cells_a_m;
  return presence;
}

}  // namespace atlas
