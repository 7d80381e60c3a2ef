#include "client/map/cell_address.h"

#include <algorithm>
#include <cmath>

#include "core/base/integer_math.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr double kMaxCoordinate_m = 1e7;  // as for poses

// Whole micrometres, rounded down; a decimal that a double cannot hold exactly counts as itself.
std::int64_t FloorMicrometres(double metres) {
  const double um = metres * 1e6;
  const double nearest = std::round(um);
  const double representation_error = std::max(1e-4, std::abs(um) * 4e-16);
  return static_cast<std::int64_t>(std::abs(um - nearest) <= representation_error ? nearest
                                                                                  : std::floor(um));
}

Status CheckPlace(const Eigen::Vector2d& p_m, std::uint8_t level, const MapProfile& profile) {
  if (level >= profile.levels) {
    return {StatusCode::kInvalidArgument,
            StrCat("level ", int{level}, ": this atlas has levels 0 to ", profile.levels - 1)};
  }
  if (!(p_m.cwiseAbs().maxCoeff() <= kMaxCoordinate_m)) {
    return {StatusCode::kInvalidArgument,
            StrCat("place (", p_m.x(), ", ", p_m.y(), ") m: expected within +-10000 km")};
  }
  return {};
}

Status CheckTileRange(std::int64_t x, std::int64_t y, const Eigen::Vector2d& p_m) {
  const auto is_in_range = [](std::int64_t coordinate) {
    return coordinate >= TileId::kMinCoordinate && coordinate <= TileId::kMaxCoordinate;
  };
  return is_in_range(x) && is_in_range(y)
             ? Status()
             : Status(StatusCode::kInvalidArgument,
                      StrCat("place (", p_m.x(), ", ", p_m.y(), ") m: no tile reaches so far"));
}

}  // namespace

double TileSideMetres(std::uint8_t level, const MapProfile& profile) {
  return std::ldexp(profile.tile_size_m(), level);
}

Eigen::Vector2d TileCenter(const TileId& id, const MapProfile& profile) {
  return TileSideMetres(id.level, profile) * Eigen::Vector2d(id.x + 0.5, id.y + 0.5);
}

Result<CellAddress> LocateCell(const Eigen::Vector2d& p_m,
                               std::uint8_t level,
                               const MapProfile& profile) {
  if (Status status = CheckPlace(p_m, level, profile); !status.ok()) {
    return Error(std::move(status));
  }
  const std::int64_t cell_um = std::int64_t{profile.cell_size_um} << level;
  const std::int64_t side = profile.tile_cells;
  const std::int64_t cell_x = FloorDiv(FloorMicrometres(p_m.x()), cell_um);
  const std::int64_t cell_y = FloorDiv(FloorMicrometres(p_m.y()), cell_um);
  const std::int64_t tile_x = FloorDiv(cell_x, side);
  const std::int64_t tile_y = FloorDiv(cell_y, side);
  if (Status status = CheckTileRange(tile_x, tile_y, p_m); !status.ok()) {
    return Error(std::move(status));
  }
  CellAddress address;
  address.tile = {level, static_cast<std::int32_t>(tile_x), static_cast<std::int32_t>(tile_y)};
  address.cell =
      static_cast<std::size_t>((cell_y - tile_y * side) * side + (cell_x - tile_x * side));
  return address;
}

Result<std::vector<TileId>> TilesInDisc(const Eigen::Vector2d& center_m,
                                        double radius_m,
                                        std::uint8_t level,
                                        const MapProfile& profile,
                                        std::size_t max_tiles) {
  const Eigen::Vector2d reach = Eigen::Vector2d::Constant(radius_m);
  const auto first = LocateCell(center_m - reach, level, profile);
  if (!first) return Error(first.error());
  const auto last = LocateCell(center_m + reach, level, profile);
  if (!last) return Error(last.error());
  const std::int64_t columns = std::int64_t{last->tile.x} - first->tile.x + 1;
  const std::int64_t rows = std::int64_t{last->tile.y} - first->tile.y + 1;
  if (static_cast<std::uint64_t>(columns * rows) > max_tiles) {
    return Error(StatusCode::kInvalidArgument,
                 StrCat("radius ", radius_m, " m at level ", int{level}, ": more than ", max_tiles,
                        " tiles"));
  }
  const double side_m = TileSideMetres(level, profile);
  std::vector<TileId> tiles;
  for (std::int32_t y = first->tile.y; y <= last->tile.y; ++y) {
    for (std::int32_t x = first->tile.x; x <= last->tile.x; ++x) {
      const Eigen::Vector2d low = side_m * Eigen::Vector2d(x, y);
      const Eigen::Vector2d high = low + Eigen::Vector2d::Constant(side_m);
      const Eigen::Vector2d nearest = center_m.cwiseMax(low).cwiseMin(high);
      if ((nearest - center_m).norm() <= radius_m) tiles.push_back({level, x, y});
    }
  }
  return tiles;
}

}  // namespace atlas
