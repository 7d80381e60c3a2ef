// Squares to cells, cells to tiles.
#include "tests/core/planning/tiny_world.h"

#include <array>
#include <cmath>
#include <utility>

#include "core/tile/tile_pyramid.h"

namespace atlas {
namespace {

// A segment of 1 m whose middle is 1.5 m above a floor at zero.
constexpr std::uint64_t kHangingThing = 0xF1;

TileLayer LayerOf(char square, double altitude_m) {
  TileLayer layer = FreeLayer(altitude_m);
  if (square == '#') {
    layer.occupancy = 64;
    layer.flags = TileLayer::kMeasured;
  } else if (square == '?') {
    layer.occupancy = 0;
    layer.flags = TileLayer::kMeasured;
  } else if (square == 'c') {
    layer.column = kHangingThing;
  }
  return layer;
}

}  // namespace

TileLayer FreeLayer(double altitude_m) {
  TileLayer layer;
  layer.altitude_mm = static_cast<std::int32_t>(std::lround(altitude_m * 1e3));
  layer.sigma_100um = 500;
  layer.occupancy = -64;
  layer.flags = TileLayer::kTraversable | TileLayer::kTraversableAny | TileLayer::kMeasured;
  layer.observations = 10;
  return layer;
}

TinyWorld::TinyWorld() {
  profile_.cell_size_um = 100'000;
  profile_.tile_cells = 32;
}

void TinyWorld::Put(std::int64_t cell_x, std::int64_t cell_y, const TileLayer& layer) {
  const std::int64_t side = profile_.tile_cells;
  const TileId id{0, static_cast<std::int32_t>(FloorDiv(cell_x, side)),
                  static_cast<std::int32_t>(FloorDiv(cell_y, side))};
  auto& cells = cells_[id.Key()];
  cells.resize(static_cast<std::size_t>(side * side));
  const std::int64_t index = (cell_y - id.y * side) * side + cell_x - id.x * side;
  cells[static_cast<std::size_t>(index)].push_back(layer);
}

void TinyWorld::Draw(const std::vector<std::string_view>& rows, double height_m) {
  Draw(rows, [height_m](double, double) { return height_m; });
}

void TinyWorld::Draw(const std::vector<std::string_view>& rows, const Height& height) {
  const double cell_m = profile_.cell_size_m();
  const auto cells = [](std::size_t squares) {
    return static_cast<std::int64_t>(squares) * kCellsPerSquare;
  };
  for (std::size_t row = 0; row < rows.size(); ++row) {
    const std::size_t y = rows.size() - 1 - row;
    for (std::size_t x = 0; x < rows[row].size(); ++x) {
      const char square = rows[row][x];
      const double x_m = (static_cast<double>(x) + 0.5) * kCellsPerSquare * cell_m;
      const double y_m = (static_cast<double>(y) + 0.5) * kCellsPerSquare * cell_m;
      if (square == 'S' || square == 'G') {
        (square == 'S' ? start_ : goal_) = Eigen::Vector3d(x_m, y_m, height(x_m, y_m));
      }
      for (int i = 0; square != ' ' && i < kCellsPerSquare * kCellsPerSquare; ++i) {
        const std::int64_t cx = cells(x) + i % kCellsPerSquare;
        const std::int64_t cy = cells(y) + i / kCellsPerSquare;
        const double z_m = height((static_cast<double>(cx) + 0.5) * cell_m,
                                  (static_cast<double>(cy) + 0.5) * cell_m);
        Put(cx, cy, LayerOf(square, z_m));
      }
    }
  }
}

Tile TinyWorld::Finest(const TileId& id) const {
  Tile tile;
  tile.id = id;
  tile.cell_begin.push_back(0);
  for (const auto& cell : cells_.at(id.Key())) {
    tile.layers.insert(tile.layers.end(), cell.begin(), cell.end());
    tile.cell_begin.push_back(static_cast<std::uint32_t>(tile.layers.size()));
  }
  return tile;
}

void TinyWorld::BuildPyramid() {
  coarser_.clear();
  std::map<std::uint64_t, Tile> below;
  for (const auto& [key, cells] : cells_) {
    below.emplace(key, Finest(TileId::FromKey(key).value()));
  }
  for (std::uint8_t level = 1; level < profile_.levels; ++level) {
    std::map<std::uint64_t, Tile> made;
    for (const auto& [key, tile] : below) {
      const TileId id = tile.id.Parent();
      if (made.contains(id.Key())) {
        continue;
      }
      std::array<const Tile*, 4> children{};
      for (std::size_t i = 0; i < children.size(); ++i) {
        const auto child = below.find(id.Children()[i].Key());
        children[i] = child == below.end() ? nullptr : &child->second;
      }
      made.emplace(id.Key(), BuildParentTile(id, children, profile_));
    }
    coarser_.insert(made.begin(), made.end());
    below = std::move(made);
  }
}

Result<const Tile*> TinyWorld::Get(const TileId& id) {
  ++tiles_asked_;
  if (!failure_.ok()) {
    return Error(failure_);
  }
  if (id.level > 0) {
    const auto found = coarser_.find(id.Key());
    return found == coarser_.end() ? nullptr : &found->second;
  }
  if (!cells_.contains(id.Key())) {
    return nullptr;
  }
  tile_ = Finest(id);
  return &tile_;
}

Result<Route> TinyWorld::Plan(const PlanOptions& options) {
  return PlanRoute(*this, profile_, {start_, goal_, options});
}

}  // namespace atlas
