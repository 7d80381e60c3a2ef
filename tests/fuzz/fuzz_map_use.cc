// What a program does with a tile that decodes, whatever is in it: parents, pictures, routes, and
// the map that a scan is matched with.
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "client/render/map_picture.h"
#include "core/localization/window/map_window.h"
#include "core/planning/plan_route.h"
#include "core/tile/tile_codec.h"
#include "core/tile/tile_pyramid.h"
#include "tests/fuzz/support/tile_packing.h"

namespace atlas::fuzz {
namespace {

// An atlas of one tile.
class OneTile final : public TileSource {
 public:
  explicit OneTile(const Tile& tile) : tile_(tile) {}

  Result<const Tile*> Get(const TileId& id) override { return id == tile_.id ? &tile_ : nullptr; }

 private:
  const Tile& tile_;
};

Eigen::Vector3d MiddleOf(const Tile& tile) {
  const double side_m = TileProfile().tile_size_m();
  const double z_m = tile.layers.empty() ? 0.0 : 1e-3 * tile.layers.front().altitude_mm;
  return {(tile.id.x + 0.5) * side_m, (tile.id.y + 0.5) * side_m, z_m};
}

void BuildParent(const Tile& tile) {
  if (tile.id.level + 1 >= TileProfile().levels) {
    return;
  }
  const TileId parent_id = tile.id.Parent();
  const auto children = parent_id.Children();
  std::array<const Tile*, 4> four{};
  for (std::size_t i = 0; i < four.size(); ++i) {
    four[i] = children[i] == tile.id ? &tile : nullptr;
  }
  const Tile parent = BuildParentTile(parent_id, four, TileProfile());
  const auto again = DecodeTile(EncodeTile(parent, TileProfile()).blob, TileProfile());
  Require(again && *again == parent, "a parent is a tile");
}

void Render(const Tile& tile) {
  const LevelReader one_level = [&tile](std::uint8_t level, const TileCallback& on_tile) {
    return level == tile.id.level ? on_tile(tile) : Status();
  };
  for (const MapColor color : {MapColor::kHeight, MapColor::kOccupancy, MapColor::kColumns}) {
    MapProfile profile = TileProfile();
    profile.levels = static_cast<std::uint8_t>(tile.id.level + 1);
    RenderOptions options;
    options.color = color;
    options.max_side_px = 128;
    const auto picture = RenderMap(one_level, options, profile);
    Require(picture.has_value() || tile.is_empty(), "a tile with cells makes a picture");
  }
}

void Plan(const Tile& tile) {
  OneTile source(tile);
  PlanRequest request;
  request.options.vehicle_width_m = 0.2;
  request.options.safety_margin_m = 0.0;
  request.from = MiddleOf(tile) - Eigen::Vector3d(1.0, 1.0, 0.0);
  request.to = MiddleOf(tile) + Eigen::Vector3d(1.0, 1.0, 0.0);
  const auto route = PlanRoute(source, TileProfile(), request);
  if (route && route->found) {
    Require(std::isfinite(route->length_m) && route->length_m < 1e3, "a route on a tile is short");
  }
}

void Match(const Tile& tile) {
  const std::vector tiles{std::make_shared<const Tile>(tile)};
  MapWindow window(TileProfile(), {});
  window.Renew(tiles, MiddleOf(tile), 4.0);
  for (const float x : {-1.0F, 0.0F, 1.5F}) {
    const Eigen::Vector3f p(x, 0.5F, 0.0F);
    static_cast<void>(window.NearestLine(p, 1.0F));
    const auto below = window.NearestSurface(p, 1.0F);
    Require(!below || std::isfinite(below->height_m), "a surface has a height");
    Require(!(window.IsFree(p) && window.IsOccupied(p)), "a place is free or not");
    static_cast<void>(window.IsMapped(p));
  }
}

bool Run(ByteSpan blob) {
  const auto tile = DecodeTile(blob, TileProfile());
  if (!tile) {
    return false;
  }
  BuildParent(*tile);
  Render(*tile);
  if (tile->id.level == 0) {
    Plan(*tile);
    Match(*tile);
  }
  return true;
}

}  // namespace

const Target kTarget{&TileSeeds, &Run, &MutateTile};

}  // namespace atlas::fuzz
