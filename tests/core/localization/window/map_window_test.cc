#include "core/localization/window/map_window.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "core/geometry/nibble.h"
#include "tests/core/localization/painted_map.h"

namespace atlas {
namespace {

using testing::ColumnLayer;
using testing::GroundLayer;
using testing::PaintedMap;

const Eigen::Vector3d kOrigin = Eigen::Vector3d::Zero();

Eigen::Vector3f InWindow(const MapWindow& window, double x, double y, double z) {
  return (Eigen::Vector3d(x, y, z) - window.origin()).cast<float>();
}

TEST(MapWindowTest, OccupiedSegmentsStandWhereTheColumnSays) {
  PaintedMap map;
  map.Put(12, -7, ColumnLayer(0.0, 0b0110));  // 1 m to 3 m over a base at 0
  const MapWindow window = map.Window(kOrigin, 10.0);
  EXPECT_EQ(window.lines(), 2U);
  for (const double z : {0.5, 1.5, 2.5, 3.5}) {
    EXPECT_EQ(window.IsOccupied(InWindow(window, 1.25, -0.65, z)), z > 1.0 && z < 3.0) << z;
    EXPECT_FALSE(window.IsOccupied(InWindow(window, 1.35, -0.65, z)));
  }
}

TEST(MapWindowTest, OnlyWhatIsProbablyThereIsOccupied) {
  for (int nibble = 0; nibble <= 15; ++nibble) {
    PaintedMap map;
    TileLayer layer = GroundLayer(0.0);
    layer.column = static_cast<std::uint64_t>(nibble);
    map.Put(0, 0, layer);
    EXPECT_EQ(map.Window(kOrigin, 5.0).lines(), nibble >= 10 ? 1U : 0U) << nibble;
  }
}

TEST(MapWindowTest, AWallsNormalPointsAcrossItInAnyDirection) {
  for (int direction = 0; direction < 12; ++direction) {
    const double angle = direction * M_PI / 12.0;
    PaintedMap map;
    std::set<std::pair<int, int>> cells;
    for (const double t : testing::Steps(-4.0, 4.0, 0.02)) {
      cells.emplace(static_cast<int>(std::floor(10.0 * t * std::cos(angle) + 0.5)),
                    static_cast<int>(std::floor(10.0 * t * std::sin(angle) + 0.5)));
    }
    for (const auto& [x, y] : cells) {
      map.Put(x, y, ColumnLayer(0.0, 0b0011));
    }
    const MapWindow window = map.Window(kOrigin, 10.0);
    const Eigen::Vector2f normal(static_cast<float>(-std::sin(angle)),
                                 static_cast<float>(std::cos(angle)));
    for (const double aside : {-0.2, 0.0, 0.2}) {
      const std::optional<ColumnLine> line = window.NearestLine(
          InWindow(window, 0.05 - aside * std::sin(angle), 0.05 + aside * std::cos(angle), 0.5),
          0.5F);
      ASSERT_TRUE(line);
      EXPECT_TRUE(line->is_wall);
      EXPECT_GT(std::abs(line->normal.dot(normal)), 0.99F) << direction;
      const Eigen::Vector2f offset = line->center - InWindow(window, 0.05, 0.05, 0.5).head<2>();
      EXPECT_LT(std::abs(offset.dot(normal)), 0.04F) << direction;
    }
  }
}

TEST(MapWindowTest, EachSegmentOfACellHasItsOwnLine) {
  PaintedMap map;  // a wall along x, one along y on a lintel above it
  for (int i = -20; i <= 20; ++i) {
    map.Put(i, 0, ColumnLayer(0.0, i == 0 ? 0b1001 : 0b0001));
    if (i != 0) {
      map.Put(0, i, ColumnLayer(0.0, 0b1000));
    }
  }
  const MapWindow window = map.Window(kOrigin, 5.0);
  const std::optional<ColumnLine> low = window.NearestLine(InWindow(window, 0.05, 0.05, 0.5), 0.5F);
  const std::optional<ColumnLine> high =
      window.NearestLine(InWindow(window, 0.05, 0.05, 3.5), 0.5F);
  ASSERT_TRUE(low && high);
  EXPECT_GT(std::abs(low->normal.y()), 0.999F);
  EXPECT_GT(std::abs(high->normal.x()), 0.999F);
  EXPECT_FALSE(window.NearestLine(InWindow(window, 0.05, 0.05, 1.5), 0.5F));
}

TEST(MapWindowTest, APostIsNoWallAndStandsInItsCell) {
  for (const int side : {1, 2, 3}) {
    PaintedMap map;
    for (int i = 0; i < side * side; ++i) {
      map.Put(20 + i % side, 30 + i / side, ColumnLayer(0.0, 0b0001));
    }
    const MapWindow window = map.Window(kOrigin, 10.0);
    const std::optional<ColumnLine> line =
        window.NearestLine(InWindow(window, 2.0, 3.0, 0.5), 0.5F);
    ASSERT_TRUE(line);
    EXPECT_FALSE(line->is_wall) << side;
    EXPECT_LT((line->center - InWindow(window, 2.05, 3.05, 0.5).head<2>()).norm(), 1e-4F);
  }
}

TEST(MapWindowTest, TheNearestLineIsTheNearest) {
  std::mt19937 random(101);
  PaintedMap map;
  std::vector<Eigen::Vector3d> segments;  // middles
  std::set<std::pair<int, int>> taken;
  for (int i = 0; i < 150; ++i) {
    // Further apart than what is taken for one structure.
    const int x = 5 * (static_cast<int>(random() % 40) - 20);
    const int y = 5 * (static_cast<int>(random() % 40) - 20);
    if (taken.emplace(x, y).second) {
      const std::uint32_t bits = random() % 16;
      map.Put(x, y, ColumnLayer(0.0, bits));
      for (int k = 0; k < 4; ++k) {
        if ((bits >> k & 1u) != 0) {
          segments.emplace_back(0.1 * x + 0.05, 0.1 * y + 0.05, k + 0.5);
        }
      }
    }
  }
  const MapWindow window = map.Window(kOrigin, 12.0);
  ASSERT_EQ(window.lines(), segments.size());
  std::uniform_real_distribution<double> place(-11.0, 11.0);
  int found = 0;
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d p(place(random), place(random), 0.5 + static_cast<int>(random() % 4));
    double nearest_m = 1.2;
    for (const Eigen::Vector3d& segment : segments) {
      if (std::abs(segment.z() - p.z()) < 0.5) {
        nearest_m = std::min(nearest_m, (segment - p).head<2>().norm());
      }
    }
    const std::optional<ColumnLine> line =
        window.NearestLine(InWindow(window, p.x(), p.y(), p.z()), 1.2F);
    ASSERT_EQ(line.has_value(), nearest_m < 1.2) << p.transpose();
    if (line && !line->is_wall) {
      ++found;
      EXPECT_NEAR((line->center - InWindow(window, p.x(), p.y(), p.z()).head<2>()).norm(),
                  nearest_m, 1e-4);
    }
  }
  EXPECT_GT(found, 500);
}

TEST(MapWindowTest, AHoleInStructureIsStructureUnlessRaysCrossedIt) {
  PaintedMap map;
  const std::uint32_t wall = 0b0010;  // the segment from 1 to 2 m
  for (int x = -20; x <= 20; ++x) {
    if (x != 0 && x != 10 && x != 11) map.Put(x, 0, ColumnLayer(0.0, wall));
  }
  map.Put(10, 0, ColumnLayer(0.0, 0));
  TileLayer crossed = ColumnLayer(0.0, 0);
  crossed.column = std::uint64_t{kNibbleFree} << 4;
  map.Put(11, 0, crossed);
  const MapWindow window = map.Window(kOrigin, 12.0);
  const auto is_occupied = [&](int x, int y) {
    return window.IsOccupied(InWindow(window, 0.1 * x + 0.05, 0.1 * y + 0.05, 1.5));
  };
  EXPECT_TRUE(is_occupied(1, 0));
  EXPECT_TRUE(is_occupied(0, 0)) << "nothing is known of it";
  EXPECT_TRUE(is_occupied(10, 0)) << "nothing is known of it, either";
  EXPECT_FALSE(is_occupied(11, 0)) << "rays crossed it";
  EXPECT_FALSE(is_occupied(21, 0)) << "behind the end";
  EXPECT_FALSE(is_occupied(5, 1)) << "beside it";
}

TEST(MapWindowTest, OfTwoDecksTheNearerOneIsTheSurface) {
  PaintedMap map;
  map.Put(3, 3, GroundLayer(0.0));
  map.Put(3, 3, GroundLayer(2.8));
  const MapWindow window = map.Window(kOrigin, 5.0);
  EXPECT_EQ(window.surfaces(), 2U);
  for (const double z : {-0.5, -0.1, 0.55, 1.3, 1.5, 2.3, 3.3}) {  // both are in reach
    const auto below = window.NearestSurface(InWindow(window, 0.35, 0.35, z), 5.0F);
    ASSERT_TRUE(below) << z;
    EXPECT_NEAR(below->height_m, z < 1.4 ? z : z - 2.8, 1e-4) << z;
  }
  EXPECT_FALSE(window.NearestSurface(InWindow(window, 0.35, 0.35, 1.4), 0.6F));
}

TEST(MapWindowTest, OnlyMeasuredGroundThatCanBeDrivenIsASurface) {
  PaintedMap map;
  TileLayer guessed = GroundLayer(0.0);
  guessed.flags = TileLayer::kTraversable;
  TileLayer obstacle = GroundLayer(0.0);
  obstacle.flags = TileLayer::kMeasured;
  map.Put(0, 0, guessed);
  map.Put(1, 0, obstacle);
  map.Put(2, 0, GroundLayer(0.0));
  EXPECT_EQ(map.Window(kOrigin, 5.0).surfaces(), 1U);
}

TEST(MapWindowTest, WhatStandsAtAGuessedHeightBesideMeasuredGroundIsNoLine) {
  // A parapet of another deck: how high its foot is was not measured.
  PaintedMap map;
  TileLayer parapet = ColumnLayer(5.5, 0b01);
  parapet.flags = 0;
  map.Put(0, 0, GroundLayer(0.0));
  map.Put(0, 0, parapet);
  map.Put(1, 0, parapet);  // all that the map knows there
  map.Put(2, 0, ColumnLayer(5.5, 0b01));
  EXPECT_EQ(map.Window(kOrigin, 5.0).lines(), 2U);
}

TEST(MapWindowTest, SlopesHaveTheirGradientAndLevelGroundHasNone) {
  for (const Eigen::Vector2d& gradient :
       {Eigen::Vector2d(0, 0), Eigen::Vector2d(0.15, 0), Eigen::Vector2d(-0.1, 0.2)}) {
    PaintedMap map;
    map.Paint({{testing::Patch{0.5, gradient}}, {}}, 6.0);
    const MapWindow window = map.Window(kOrigin, 10.0);
    for (const Eigen::Vector2d& p : {Eigen::Vector2d(0.03, 0.08), Eigen::Vector2d(-3.2, 2.7)}) {
      const double ground_m = 0.5 + gradient.dot(p);
      const auto below =
          window.NearestSurface(InWindow(window, p.x(), p.y(), ground_m + 0.1), 0.6F);
      ASSERT_TRUE(below);
      EXPECT_NEAR(below->height_m, 0.1, 2e-3);
      EXPECT_LT((below->plane.gradient.cast<double>() - gradient).norm(), 2e-3);
    }
  }
}

TEST(MapWindowTest, FreeIsWhatRaysCrossedAndNothingElse) {
  for (int nibble = 0; nibble <= 15; ++nibble) {
    PaintedMap map;
    TileLayer layer = GroundLayer(0.0);
    layer.column = static_cast<std::uint64_t>(nibble) << 4;
    map.Put(0, 0, layer);
    const MapWindow window = map.Window(kOrigin, 5.0);
    EXPECT_EQ(window.IsFree(InWindow(window, 0.05, 0.05, 1.5)), nibble >= 1 && nibble <= 6);
    EXPECT_FALSE(window.IsFree(InWindow(window, 0.05, 0.05, 0.5)));   // another segment
    EXPECT_FALSE(window.IsFree(InWindow(window, 0.15, 0.05, 1.5)));   // another cell
    EXPECT_FALSE(window.IsFree(InWindow(window, 0.05, 0.05, 1.95)));  // may belong to the next
  }
}

TEST(MapWindowTest, WhatIsJustBelowASurfaceIsItsSlabAndNotFree) {
  PaintedMap map;
  TileLayer ground = GroundLayer(0.0);
  ground.column = 0x11111;
  TileLayer deck = GroundLayer(5.5);
  deck.column = 0x11;  // 5 m to 7 m: the slab is in the lowest
  map.Put(0, 0, ground);
  map.Put(0, 0, deck);
  const MapWindow window = map.Window(kOrigin, 5.0);
  for (const auto& [z, is_free] : {std::pair(4.5, true), std::pair(4.85, false),
                                   std::pair(5.3, false), std::pair(5.6, true)}) {
    EXPECT_EQ(window.IsFree(InWindow(window, 0.05, 0.05, z)), is_free) << z;
  }
}

// A wall along x at y = 0.05 m with free ground on the sides asked for.
PaintedMap WallWithFreeSides(bool is_free_south, bool is_free_north) {
  TileLayer free = GroundLayer(0.0);
  free.column = 0x11;
  PaintedMap map;
  for (int x = -30; x <= 30; ++x) {
    map.Put(x, 0, ColumnLayer(0.0, 0b0011));
    for (int y = 1; y <= 10; ++y) {
      if (is_free_south) map.Put(x, -y, free);
      if (is_free_north) map.Put(x, y, free);
    }
  }
  return map;
}

TEST(MapWindowTest, AFaceIsSeenFromItsFreeSideAlone) {
  for (const auto& [south, north] : {std::pair(true, true), std::pair(true, false),
                                     std::pair(false, true), std::pair(false, false)}) {
    const MapWindow window = WallWithFreeSides(south, north).Window(kOrigin, 10.0);
    const std::optional<ColumnLine> line =
        window.NearestLine(InWindow(window, 0.05, 0.05, 0.5), 0.3F);
    ASSERT_TRUE(line);
    EXPECT_TRUE(line->is_wall);
    EXPECT_EQ(line->is_one_sided, south != north);
    const auto is_seen_from = [&](double y) {
      return line->CanBeSeenFrom(InWindow(window, 1.0, y, 0.0).head<2>());
    };
    EXPECT_EQ(is_seen_from(-3.0), south || !north);
    EXPECT_EQ(is_seen_from(3.0), north || !south);
  }
}

}  // namespace
}  // namespace atlas
