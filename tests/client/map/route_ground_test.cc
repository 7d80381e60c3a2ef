// Routes on tiles of two decks, beside them, between them and of another level.
#include "client/map/route_ground.h"

#include <vector>

#include <gtest/gtest.h>

namespace atlas {
namespace {

MapProfile SmallProfile() {
  MapProfile profile;  // cells of 0.1 m
  profile.tile_cells = 16;
  profile.levels = 3;
  return profile;
}

// Every cell has these surfaces.
Tile FlatTile(const TileId& id, const std::vector<std::int32_t>& altitudes_mm) {
  Tile tile = EmptyTile(id, SmallProfile());
  for (std::size_t cell = 0; cell + 1 < tile.cell_begin.size(); ++cell) {
    for (const std::int32_t altitude_mm : altitudes_mm) {
      TileLayer layer;
      layer.altitude_mm = altitude_mm;
      tile.layers.push_back(layer);
    }
    tile.cell_begin[cell + 1] = static_cast<std::uint32_t>(tile.layers.size());
  }
  return tile;
}

TEST(RouteGroundTest, PointsAreOnTilesAndOnTheirSurfaces) {
  const std::vector<Eigen::Vector3d> route = {
      {0.05, 0.05, 0.3},  {1.55, 0.05, 4.0},  // on either deck of the first tile
      {0.05, 1.55, 2.0},                      // between them
      {-0.05, 0.05, 0.0},                     // a tile without a surface
      {1.65, 0.05, 0.0},                      // no tile
      {1e9, 0.0, 0.0}};                       // beyond all tiles
  RouteGround ground(route, SmallProfile());
  EXPECT_EQ(ground.points(), 6U);
  EXPECT_EQ(ground.on_tiles(), 0U);
  ground.Add(FlatTile({0, 0, 0}, {0, 4000}));
  ground.Add(FlatTile({0, -1, 0}, {}));
  ground.Add(FlatTile({0, 0, 0}, {0, 4000}));  // read twice, counted once
  EXPECT_EQ(ground.on_tiles(), 4U);
  EXPECT_EQ(ground.on_surfaces(), 2U);
}

TEST(RouteGroundTest, AFinerLevelHasTheLastWord) {
  const std::vector<Eigen::Vector3d> route = {{0.05, 0.05, 1.1}, {3.0, 3.0, 0.0}};
  RouteGround ground(route, SmallProfile());
  ground.Add(FlatTile({2, 0, 0}, {0}));
  EXPECT_EQ(ground.on_tiles(), 2U);
  EXPECT_EQ(ground.on_surfaces(), 2U) << "half a coarse cell more";
  ground.Add(FlatTile({0, 0, 0}, {0}));
  EXPECT_EQ(ground.on_tiles(), 1U);
  EXPECT_EQ(ground.on_surfaces(), 0U);
}

}  // namespace
}  // namespace atlas
