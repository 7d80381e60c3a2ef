// A window that moves and whose tiles come late, in pieces and changed, against one made anew.
#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "core/localization/window/map_window.h"
#include "tests/core/localization/painted_map.h"

namespace atlas {
namespace {

using testing::ColumnLayer;
using testing::PaintedMap;
using testing::StreetMap;

using Tiles = std::vector<std::shared_ptr<const Tile>>;

Eigen::Vector3f In(const MapWindow& window, const Eigen::Vector3d& p) {
  return (p - window.origin()).cast<float>();
}

// What both say about a place of the world.
void ExpectSame(const MapWindow& a, const MapWindow& b, const Eigen::Vector3d& p) {
  static const CellKernel kKernel(0.4F);
  const Eigen::Vector3f in_a = In(a, p);
  const Eigen::Vector3f in_b = In(b, p);
  ASSERT_EQ(a.IsFree(in_a), b.IsFree(in_b)) << p.transpose();
  ASSERT_EQ(a.IsOccupied(in_a), b.IsOccupied(in_b)) << p.transpose();
  ASSERT_EQ(a.LevelAt(in_a), b.LevelAt(in_b)) << p.transpose();
  ASSERT_NEAR(a.PresenceAt(in_a, kKernel).value, b.PresenceAt(in_b, kKernel).value, 1e-2);
  const auto line_a = a.NearestLine(in_a, 0.9F);
  const auto line_b = b.NearestLine(in_b, 0.9F);
  ASSERT_EQ(line_a.has_value(), line_b.has_value()) << p.transpose();
  if (line_a) {
    const Eigen::Vector2f from_a = line_a->center - in_a.head<2>();
    const Eigen::Vector2f from_b = line_b->center - in_b.head<2>();
    ASSERT_LT((from_a - from_b).norm(), 1e-3F) << p.transpose();
    ASSERT_EQ(line_a->is_wall, line_b->is_wall);
    ASSERT_EQ(line_a->is_one_sided, line_b->is_one_sided) << p.transpose();
    ASSERT_LT((line_a->normal - line_b->normal).norm(), 1e-3F);
  }
  const auto below_a = a.NearestSurface(in_a, 1.0F);
  const auto below_b = b.NearestSurface(in_b, 1.0F);
  ASSERT_EQ(below_a.has_value(), below_b.has_value()) << p.transpose();
  if (below_a) {
    ASSERT_NEAR(below_a->height_m, below_b->height_m, 1e-3);
    ASSERT_LT((below_a->plane.gradient - below_b->plane.gradient).norm(), 1e-3F);
  }
}

// Off the edges of cells, where rounding decides.
Eigen::Vector3d SomePlace(std::mt19937& random, const Eigen::Vector3d& center, double reach_m) {
  std::uniform_int_distribution<int> cell(static_cast<int>(-10.0 * reach_m),
                                          static_cast<int>(10.0 * reach_m));
  std::uniform_real_distribution<double> within(0.02, 0.08);
  const auto coordinate = [&](double at_m) {
    return 0.1 * (std::floor(10.0 * at_m) + cell(random)) + within(random);
  };
  const double x = coordinate(center.x());
  const double y = coordinate(center.y());
  return {x, y, std::uniform_int_distribution<int>(-2, 6)(random) + 0.3 + within(random)};
}

TEST(MovingWindowTest, IsWhatANewOneIsWhereverItHasBeenAndWhateverItHad) {
  std::mt19937 random(601);
  const Tiles all = StreetMap().Tiles();
  const Tiles coarse = StreetMap().TilesOfLevel(2);
  MapWindow moved(StreetMap().profile(), PlaceOptions());
  Eigen::Vector3d center(-15.0, 0.0, 1.8);
  for (int step = 0; step < 40; ++step) {
    // Of the tiles some; now and then another copy, as after a change, or a coarser one below.
    Tiles tiles;
    for (const auto& tile : all) {
      const unsigned choice = random() % 8;
      if (choice == 0) continue;
      tiles.push_back(choice == 1 ? std::make_shared<const Tile>(*tile) : tile);
    }
    for (const auto& tile : coarse) {
      if (random() % 3 == 0) tiles.push_back(tile);
    }
    std::shuffle(tiles.begin(), tiles.end(), random);
    const double radius_m = 6.0 + static_cast<double>(random() % 15);
    moved.Renew(tiles, center, radius_m);
    MapWindow made(StreetMap().profile(), PlaceOptions());
    made.Renew(tiles, center, radius_m);
    ASSERT_EQ(moved.lines(), made.lines()) << step;
    ASSERT_EQ(moved.surfaces(), made.surfaces()) << step;
    for (int i = 0; i < 400; ++i) {
      ASSERT_NO_FATAL_FAILURE(ExpectSame(moved, made, SomePlace(random, center, radius_m))) << step;
    }
    center += Eigen::Vector3d(static_cast<double>(random() % 9) - 3.0,
                              static_cast<double>(random() % 5) - 2.0,
                              0.25 * (static_cast<double>(random() % 5) - 2.0));
  }
}

// Many of the window's segments: all that it read lies on other bits then.
TEST(MovingWindowTest, FollowsItsVehicleUpAndDown) {
  PaintedMap map;
  for (int deck = 0; deck < 20; ++deck) {
    map.Put(3, 3, ColumnLayer(6.0 * deck, 0b0011));
  }
  const Tiles tiles = map.Tiles();
  MapWindow window(map.profile(), PlaceOptions());
  for (const int deck : {0, 1, 4, 19, 18, 9, 0}) {
    window.Renew(tiles, {0.0, 0.0, 6.0 * deck + 1.8}, 5.0);
    for (const double up_m : {0.5, 1.5, 2.5}) {
      const Eigen::Vector3f p = In(window, {0.35, 0.35, 6.0 * deck + up_m});
      EXPECT_EQ(window.IsOccupied(p), up_m < 2.0) << deck;
      EXPECT_EQ(window.NearestLine(p, 0.3F).has_value(), up_m < 2.0) << deck;
    }
    EXPECT_TRUE(window.NearestSurface(In(window, {0.35, 0.35, 6.0 * deck + 0.1}), 0.3F)) << deck;
  }
}

TEST(MovingWindowTest, ACoarseTileStandsInForItsFineOnesUntilTheyCome) {
  const Tiles fine = StreetMap().Tiles();
  for (const std::uint8_t level : {std::uint8_t{1}, std::uint8_t{2}, std::uint8_t{3}}) {
    Tiles tiles = StreetMap().TilesOfLevel(level);
    MapWindow window(StreetMap().profile(), PlaceOptions());
    const Eigen::Vector3d ground(0.05, 0.05, 0.05);
    window.Renew(tiles, ground, 12.0);
    EXPECT_EQ(window.LevelAt(In(window, ground)), static_cast<int>(level));
    ASSERT_TRUE(window.NearestSurface(In(window, ground), 0.3F));
    EXPECT_GT(window.lines(), 1'000U) << "in cells of level 0";
    const auto own = std::find_if(fine.begin(), fine.end(), [](const auto& tile) {
      return tile->id == TileId{0, 0, 0};
    });
    ASSERT_NE(own, fine.end());
    tiles.push_back(*own);
    window.Renew(tiles, ground, 12.0);
    EXPECT_EQ(window.LevelAt(In(window, ground)), 0);
    EXPECT_EQ(window.LevelAt(In(window, {-0.05, 0.05, 0.05})), static_cast<int>(level));
  }
}

// The place of the point stays as it is: only what is beside it comes, changes and goes.
TEST(MovingWindowTest, APlaceKnowsWhatIsBesideItNow) {
  PaintedMap walls;
  PaintedMap post;
  for (int y = -10; y <= 10; ++y) walls.Put(-2, 32 + y, ColumnLayer(0.0, 0b0001));
  post.Put(-4, 32, ColumnLayer(0.0, 0b0001));
  PaintedMap own;
  own.Put(3, 32, testing::GroundLayer(0.0));
  const Tiles here = own.Tiles();
  MapWindow window(own.profile(), PlaceOptions());
  const auto nearest = [&](Tiles beside) {
    beside.insert(beside.end(), here.begin(), here.end());
    window.Renew(beside, {0.0, 3.2, 1.0}, 5.0);
    return window.NearestLine(In(window, {0.05, 3.25, 0.5}), 0.9F);
  };
  EXPECT_FALSE(nearest({}));
  const auto at_wall = nearest(walls.Tiles());
  ASSERT_TRUE(at_wall);
  EXPECT_TRUE(at_wall->is_wall);
  const auto at_post = nearest(post.Tiles());
  ASSERT_TRUE(at_post);
  EXPECT_FALSE(at_post->is_wall);
  EXPECT_NEAR(at_post->center.x() - In(window, {0.0, 0.0, 0.0}).x(), -0.35F, 1e-3F);
  EXPECT_FALSE(nearest({}));
}

// Places without a tile leave the window, and their memory becomes another place's.
TEST(MovingWindowTest, APlaceForgetsWhoWasBesideIt) {
  PaintedMap map;  // tiles of 64 cells
  TileLayer free = testing::GroundLayer(0.0);
  free.column = 1;
  for (int y = 22; y <= 42; ++y) {
    for (const int wall : {1, 62}) map.Put(wall, y, ColumnLayer(0.0, 0b0001));
    for (int x = 3; x <= 60; ++x) map.Put(x, y, free);     // between the walls alone
    for (int x = 192; x <= 255; ++x) map.Put(x, y, free);  // all across tile 3
  }
  const Tiles tiles = map.Tiles();
  ASSERT_EQ(tiles.size(), 2U);
  MapWindow window(map.profile(), PlaceOptions());
  window.Renew(std::span(tiles).first(1), {3.2, 3.2, 1.0}, 5.0);
  // Now the place to the west is out of sight, and those to the east come in.
  window.Renew(tiles, {13.0, 3.2, 1.0}, 12.0);
  MapWindow made(map.profile(), PlaceOptions());
  made.Renew(tiles, {13.0, 3.2, 1.0}, 12.0);
  for (const double x : {0.15, 6.25}) {
    const auto line = window.NearestLine(In(window, {x, 3.25, 0.5}), 0.3F);
    ASSERT_TRUE(line);
    EXPECT_TRUE(line->is_one_sided) << "nothing is known beyond the wall at " << x;
  }
  for (const double x : testing::Steps(0.05, 7.0, 0.1)) {
    ASSERT_NO_FATAL_FAILURE(ExpectSame(window, made, {x, 3.25, 0.5})) << x;
  }
}

TEST(MovingWindowTest, WhatStandsAtThePlacesEdgeIsFoundFromBesideIt) {
  PaintedMap map;
  map.Put(0, 0, ColumnLayer(0.0, 0b0001));  // the lowest corner of its tile; no other is there
  const MapWindow window = map.Window(Eigen::Vector3d::Zero(), 10.0);
  EXPECT_TRUE(window.NearestLine(In(window, {-0.35, -0.35, 0.5}), 0.9F));
  const CellKernel kernel(0.4F);
  EXPECT_GT(window.PresenceAt(In(window, {-0.01, 0.05, 0.5}), kernel).value, 0.2F);
}

// Tiles of so few cells that a border of the usual width would reach beyond the ones beside them.
TEST(MovingWindowTest, SmallTilesHaveNoSeamsEither) {
  MapProfile profile;
  profile.tile_cells = 16;
  Tiles tiles;
  for (int x = -4; x < 4; ++x) {
    Tile tile = EmptyTile({0, x, 0}, profile);
    tile.layers.clear();
    tile.cell_begin.assign(1, 0);
    for (int cell = 0; cell < 16 * 16; ++cell) {
      if (cell / 16 == 8) tile.layers.push_back(ColumnLayer(0.0, 0b0001));
      tile.cell_begin.push_back(static_cast<std::uint32_t>(tile.layers.size()));
    }
    tiles.push_back(std::make_shared<const Tile>(std::move(tile)));
  }
  const MapWindow window = testing::Window(profile, tiles, Eigen::Vector3d::Zero(), 5.0);
  for (const double x : testing::Steps(-4.05, 4.0, 0.1)) {
    const auto line = window.NearestLine(In(window, {x, 1.15, 0.5}), 0.6F);
    ASSERT_TRUE(line) << x;
    EXPECT_TRUE(line->is_wall) << x;
    EXPECT_GT(std::abs(line->normal.y()), 0.99F) << x;
  }
}

}  // namespace
}  // namespace atlas
