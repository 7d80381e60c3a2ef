#include "tests/core/localization/painted_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>

#include "core/base/integer_math.h"
#include "core/geometry/nibble.h"
#include "core/tile/column_lattice.h"
#include "core/tile/tile_pyramid.h"

namespace atlas::testing {
namespace {

constexpr double kCell_m = 0.1;
constexpr double kEdge_m = 0.501 * kCell_m;
constexpr std::uint8_t kOccupied = 15;

bool IsWithin(double value, double low, double high) {
  return value > low && value < high;
}

// Whether a face of the box stands in the cell around (x, y).
bool HasFaceAt(const Box& box, double x, double y) {
  const bool is_on = IsWithin(x, box.low.x() - kEdge_m, box.high.x() + kEdge_m) &&
                     IsWithin(y, box.low.y() - kEdge_m, box.high.y() + kEdge_m);
  const bool is_inside = IsWithin(x, box.low.x() + kEdge_m, box.high.x() - kEdge_m) &&
                         IsWithin(y, box.low.y() + kEdge_m, box.high.y() - kEdge_m);
  return is_on && !is_inside;
}

bool IsInside(const Box& box, double x, double y, double z) {
  return IsWithin(x, box.low.x(), box.high.x()) && IsWithin(y, box.low.y(), box.high.y()) &&
         z >= box.low.z() && z < box.high.z();
}

// A column at (x, y): occupied where faces of boxes reach into a segment, free elsewhere.
std::uint64_t ColumnAt(const ShapeWorld& world,
                       double x,
                       double y,
                       const ColumnSpan& span,
                       const MapProfile& profile) {
  std::uint64_t column = 0;
  for (int k = 0; k < profile.column_segments; ++k) {
    const double low_m = (span.base + k) * profile.segment_height_m();
    const double high_m = low_m + profile.segment_height_m();
    const bool is_occupied =
        std::any_of(world.boxes.begin(), world.boxes.end(), [&](const Box& box) {
          return HasFaceAt(box, x, y) && box.low.z() < high_m - 0.05 && box.high.z() > low_m + 0.05;
        });
    column |= std::uint64_t{is_occupied ? kOccupied : kNibbleFree} << (4 * k);
  }
  return column & span.mask;
}

// What a ground at (x, y) shows of the boxes between it and the next one above, if there is one.
bool HasWall(
    const ShapeWorld& world, double x, double y, double ground_m, std::optional<double> above_m) {
  return std::any_of(world.boxes.begin(), world.boxes.end(), [&](const Box& box) {
    return HasFaceAt(box, x, y) && box.high.z() > ground_m + 0.05 &&
           (!above_m || box.low.z() < *above_m - 0.05);
  });
}
bool IsHidden(const ShapeWorld& world, double x, double y, double ground_m) {
  return std::any_of(world.boxes.begin(), world.boxes.end(),
                     [&](const Box& box) { return IsInside(box, x, y, ground_m + 0.5); });
}

std::vector<double> GroundsAt(const ShapeWorld& world, double x, double y) {
  std::vector<double> grounds_m;
  for (const Patch& patch : world.patches) {
    if (patch.surface == Surface::kGround && patch.Covers(x, y)) {
      grounds_m.push_back(patch.HeightAt(x, y));
    }
  }
  std::sort(grounds_m.begin(), grounds_m.end());
  return grounds_m;
}

PaintedMap Painted(const ShapeWorld& world, double half_m) {
  PaintedMap map;
  map.Paint(world, half_m);
  return map;
}

}  // namespace

PaintedMap::PaintedMap() {
  profile_.tile_cells = 64;
}

void PaintedMap::Paint(const ShapeWorld& world, double half_m) {
  const auto half = static_cast<std::int64_t>(std::lround(half_m / kCell_m));
  for (std::int64_t cy = -half; cy < half; ++cy) {
    for (std::int64_t cx = -half; cx < half; ++cx) {
      PaintCell(world, cx, cy);
    }
  }
}

void PaintedMap::PaintCell(const ShapeWorld& world, std::int64_t cell_x, std::int64_t cell_y) {
  const double x = (static_cast<double>(cell_x) + 0.5) * kCell_m;
  const double y = (static_cast<double>(cell_y) + 0.5) * kCell_m;
  const std::vector<double> grounds_m = GroundsAt(world, x, y);
  for (std::size_t i = 0; i < grounds_m.size(); ++i) {
    const auto above_m = i + 1 < grounds_m.size() ? std::optional(grounds_m[i + 1]) : std::nullopt;
    const auto above_mm = static_cast<std::int32_t>(1000.0 * above_m.value_or(0.0));
    TileLayer layer = GroundLayer(grounds_m[i]);
    const ColumnSpan span =
        ColumnSpanOf(layer.altitude_mm, above_m ? &above_mm : nullptr, profile_);
    layer.column = ColumnAt(world, x, y, span, profile_);
    const bool is_wall = HasWall(world, x, y, grounds_m[i], above_m);
    if (is_wall) {
      layer.flags = TileLayer::kMeasured;
    }
    if (is_wall || !IsHidden(world, x, y, grounds_m[i])) {
      Put(cell_x, cell_y, layer);
    }
  }
}

void PaintedMap::Put(std::int64_t cell_x, std::int64_t cell_y, const TileLayer& layer) {
  const std::int64_t side = profile_.tile_cells;
  const TileId id{0, static_cast<std::int32_t>(FloorDiv(cell_x, side)),
                  static_cast<std::int32_t>(FloorDiv(cell_y, side))};
  auto& cells = cells_[id];
  cells.resize(static_cast<std::size_t>(side * side));
  const std::int64_t index = (cell_y - id.y * side) * side + cell_x - id.x * side;
  cells[static_cast<std::size_t>(index)].push_back(layer);
}

std::vector<std::shared_ptr<const Tile>> PaintedMap::Tiles() const {
  std::vector<std::shared_ptr<const Tile>> tiles;
  for (const auto& [id, cells] : cells_) {
    Tile tile;
    tile.id = id;
    tile.cell_begin.push_back(0);
    for (const std::vector<TileLayer>& layers : cells) {
      tile.layers.insert(tile.layers.end(), layers.begin(), layers.end());
      tile.cell_begin.push_back(static_cast<std::uint32_t>(tile.layers.size()));
    }
    tiles.push_back(std::make_shared<const Tile>(std::move(tile)));
  }
  return tiles;
}

std::vector<std::shared_ptr<const Tile>> PaintedMap::TilesOfLevel(std::uint8_t level) const {
  if (level == 0) {
    return Tiles();
  }
  const auto below = TilesOfLevel(static_cast<std::uint8_t>(level - 1));
  std::map<TileId, const Tile*> by_id;
  std::set<TileId> parents;
  for (const auto& tile : below) {
    by_id[tile->id] = tile.get();
    parents.insert(tile->id.Parent());
  }
  std::vector<std::shared_ptr<const Tile>> tiles;
  for (const TileId& id : parents) {
    std::array<const Tile*, 4> children{};
    for (std::size_t i = 0; i < children.size(); ++i) {
      const auto child = by_id.find(id.Children().at(i));
      children.at(i) = child == by_id.end() ? nullptr : child->second;
    }
    tiles.push_back(std::make_shared<const Tile>(BuildParentTile(id, children, profile_)));
  }
  return tiles;
}

TilesAround PaintedMap::Source() const {
  return [tiles = Tiles()](const Eigen::Vector3d&,
                           double) -> Result<std::vector<std::shared_ptr<const Tile>>> {
    return tiles;
  };
}

MapWindow Window(const MapProfile& profile,
                 MapWindow::Tiles tiles,
                 const Eigen::Vector3d& center,
                 double radius_m) {
  MapWindow window(profile, PlaceOptions());
  window.Renew(tiles, center, radius_m);
  return window;
}

MapWindow PaintedMap::Window(const Eigen::Vector3d& center, double radius_m) const {
  return testing::Window(profile_, Tiles(), center, radius_m);
}

std::shared_ptr<const PlaceIndex> PlacesOf(const PaintedMap& map) {
  auto places = std::make_shared<PlaceIndex>(map.profile());
  for (const auto& tile : map.Tiles()) places->Add(*tile);
  places->Finish();
  return places;
}

TileLayer GroundLayer(double altitude_m) {
  TileLayer layer;
  layer.altitude_mm = static_cast<std::int32_t>(std::lround(1000.0 * altitude_m));
  layer.sigma_100um = 500;
  layer.occupancy = -64;
  layer.flags = TileLayer::kTraversable | TileLayer::kTraversableAny | TileLayer::kMeasured;
  layer.observations = 10;
  return layer;
}

TileLayer ColumnLayer(double altitude_m, std::uint32_t segments) {
  TileLayer layer = GroundLayer(altitude_m);
  for (unsigned k = 0; k < 16; ++k) {
    layer.column |= (segments >> k & 1u) != 0 ? std::uint64_t{15} << (4 * k) : 0;
  }
  return layer;
}

ShapeWorld Street() {
  ShapeWorld world;
  world.patches = {Patch{0.0, {0.01, 0.0}}};
  for (const auto& [begin, end] : {std::pair(-39.95, -22.05), std::pair(-18.05, -4.05),
                                   std::pair(0.05, 15.05), std::pair(19.55, 39.95)}) {
    world.boxes.push_back(Box{{begin, 8.05, -2.0}, {end, 14.05, 9.0}});
    world.boxes.push_back(Box{{begin + 6.0, -15.05, -2.0}, {end + 4.5, -9.05, 7.0}});
  }
  for (const double x : {-25.05, -11.05, 2.05, 12.55, 27.05}) {
    world.boxes.push_back(Box{{x, 5.05, -2.0}, {x + 0.2, 5.25, 5.0}});
    world.boxes.push_back(Box{{x + 4.0, -6.05, -2.0}, {x + 4.2, -5.85, 5.0}});
  }
  return world;
}

ShapeWorld GarageCorner() {
  ShapeWorld world;
  world.patches = {Patch{0.0}, Patch{3.0}, Patch{2.7, {0.0, 0.0}, Surface::kCeiling}};
  world.boxes = {Box{{-30.0, -14.05, -1.0}, {30.0, -12.05, 6.0}},
                 Box{{-16.05, -30.0, -1.0}, {-14.05, 30.0, 6.0}}};
  for (int i = 0; i < 9; ++i) {
    const double x = -9.05 + 7.0 * (i % 3);
    const double y = -7.05 + 6.0 * std::floor(i / 3.0);
    world.boxes.push_back(Box{{x, y, 0.0}, {x + 0.5, y + 0.5, 2.7}});
    world.boxes.push_back(Box{{x + 2.5, y + 1.6, 3.0}, {x + 3.0, y + 2.1, 6.0}});
  }
  return world;
}

ShapeWorld TwoYards() {
  ShapeWorld world;
  world.patches = {Patch{}};
  for (const double x : {-20.0, 20.0}) {
    world.boxes.push_back({{x - 6.05, 5.05, -1.0}, {x + 4.05, 6.05, 4.0}});
    world.boxes.push_back({{x + 7.05, -5.05, -1.0}, {x + 8.05, 2.05, 4.0}});
    world.boxes.push_back({{x - 8.05, -6.05, -1.0}, {x - 7.55, -5.55, 4.0}});
  }
  return world;
}

ShapeWorld Corridor() {
  ShapeWorld world;
  world.patches = {Patch{}};
  world.boxes = {Box{{-1e3, 4.05, -1.0}, {1e3, 6.05, 8.0}},
                 Box{{-1e3, -6.05, -1.0}, {1e3, -4.05, 8.0}}};
  return world;
}

const PaintedMap& StreetMap() {
  static const PaintedMap kMap = Painted(Street(), 30.0);
  return kMap;
}

const PaintedMap& GarageMap() {
  static const PaintedMap kMap = Painted(GarageCorner(), 20.0);
  return kMap;
}

SyntheticSensor QuickSensor() {
  return {Rings(16, -15.0, 2.0), 720};
}

LocalizerOptions QuickOptions() {
  LocalizerOptions options;
  options.features.max_range_m = 25.0F;
  options.min_good_reach_m = 0.0;  // nothing in these worlds looks like anything else by chance
  options.tracker.map.margin_m = 10.0;
  return options;
}

PoseError ErrorOf(const Pose& pose, const Pose& truth) {
  const Eigen::Vector3d offset = pose.translation() - truth.translation();
  return {offset.head<2>().norm(), std::abs(offset.z()),
          Eigen::AngleAxisd(pose.linear() * truth.linear().transpose()).angle()};
}

}  // namespace atlas::testing
