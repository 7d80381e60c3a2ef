// Where a window ends and what it is made of: tiles in any order, elsewhere, far away, none.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "core/localization/window/map_window.h"
#include "tests/core/localization/painted_map.h"

namespace atlas {
namespace {

using testing::ColumnLayer;
using testing::PaintedMap;

const Eigen::Vector3d kOrigin = Eigen::Vector3d::Zero();

Eigen::Vector3f InWindow(const MapWindow& window, double x, double y, double z) {
  return (Eigen::Vector3d(x, y, z) - window.origin()).cast<float>();
}

TEST(MapWindowTilesTest, PlacesOutsideTheWindowHaveNothing) {
  PaintedMap map;
  map.Put(0, 0, ColumnLayer(0.0, 0xFF));
  const MapWindow window = map.Window(kOrigin, 5.0);
  for (const Eigen::Vector3d& p :
       {Eigen::Vector3d(500, 0, 0.5), Eigen::Vector3d(0, -500, 0.5), Eigen::Vector3d(0, 0, 500),
        Eigen::Vector3d(0, 0, -500), Eigen::Vector3d(-5.2, 5.2, 0.5)}) {
    EXPECT_FALSE(window.NearestLine(InWindow(window, p.x(), p.y(), p.z()), 1.0F));
    EXPECT_FALSE(window.IsOccupied(InWindow(window, p.x(), p.y(), p.z())));
    EXPECT_FALSE(window.NearestSurface(InWindow(window, p.x(), p.y(), p.z()), 1.0F));
  }
}

TEST(MapWindowTilesTest, TilesMayComeInAnyOrderAndMeetWithoutASeam) {
  PaintedMap map;
  map.Paint({{testing::Patch{}}, {testing::Box{{-7.95, 0.05, -1.0}, {7.95, 0.45, 3.0}}}}, 9.0);
  std::vector<std::shared_ptr<const Tile>> tiles = map.Tiles();
  ASSERT_GT(tiles.size(), 4U);
  const MapWindow first = testing::Window(map.profile(), tiles, kOrigin, 9.0);
  std::reverse(tiles.begin(), tiles.end());
  const MapWindow second = testing::Window(map.profile(), tiles, kOrigin, 9.0);
  for (const double x : testing::Steps(-6.05, 6.0, 0.1)) {  // seams at 0 and at +-6.4 m
    const Eigen::Vector3f p = InWindow(first, x, -0.2, 0.5);
    const std::optional<ColumnLine> a = first.NearestLine(p, 0.6F);
    const std::optional<ColumnLine> b = second.NearestLine(p, 0.6F);
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->center, b->center);
    EXPECT_EQ(a->normal, b->normal);
    EXPECT_GT(std::abs(a->normal.y()), 0.99F) << x;
  }
}

TEST(MapWindowTilesTest, TilesElsewhereAreIgnoredHoweverFar) {
  PaintedMap map;
  map.Put(0, 0, ColumnLayer(0.0, 0b0001));
  const Tile near = *map.Tiles().front();
  for (const std::int32_t x :
       {3, -3, 1 << 20, -(1 << 20), 1 << 26, TileId::kMaxCoordinate, TileId::kMinCoordinate}) {
    Tile far = near;
    far.id.x = x;
    const std::vector tiles{std::make_shared<const Tile>(far)};
    const MapWindow window = testing::Window(map.profile(), tiles, kOrigin, 10.0);
    EXPECT_EQ(window.lines() + window.surfaces(), 0U) << x;
  }
}

TEST(MapWindowTilesTest, FarFromTheWorldsOriginNothingIsLost) {
  PaintedMap near;
  PaintedMap far;
  constexpr std::int64_t kAway = 90'000'000;  // 9,000 km in cells
  for (int i = 0; i < 40; ++i) {
    near.Put(i, 5, ColumnLayer(0.0, 0b0011));
    far.Put(kAway + i, 5 - kAway, ColumnLayer(0.0, 0b0011));
  }
  const MapWindow a = near.Window({2.0, 0.5, 1.0}, 6.0);
  const MapWindow b = far.Window({9e6 + 2.0, 0.5 - 9e6, 1.0}, 6.0);
  ASSERT_EQ(a.lines(), b.lines());
  const std::optional<ColumnLine> near_line = a.NearestLine(InWindow(a, 2.03, 0.35, 0.5), 0.6F);
  const std::optional<ColumnLine> far_line =
      b.NearestLine(InWindow(b, 9e6 + 2.03, 0.35 - 9e6, 0.5), 0.6F);
  ASSERT_TRUE(near_line && far_line);
  const Eigen::Vector2d near_world = a.origin().head<2>() + near_line->center.cast<double>();
  const Eigen::Vector2d far_world = b.origin().head<2>() + far_line->center.cast<double>();
  EXPECT_LT((far_world - near_world - Eigen::Vector2d(9e6, -9e6)).norm(), 1e-3);
}

TEST(MapWindowTilesTest, NoTilesMakeAnEmptyWindow) {
  const MapWindow window = testing::Window(MapProfile(), {}, kOrigin, 20.0);
  EXPECT_EQ(window.lines(), 0U);
  EXPECT_EQ(window.surfaces(), 0U);
  EXPECT_FALSE(window.NearestLine(InWindow(window, 0, 0, 0.5), 1.0F));
}

}  // namespace
}  // namespace atlas
