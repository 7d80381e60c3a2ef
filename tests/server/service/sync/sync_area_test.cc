#include "server/service/sync/sync_area.h"

#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <vector>

#include <gtest/gtest.h>

namespace atlas {
namespace {

using Eigen::Vector2d;

SyncArea Make(MapArea shape) {
  auto area = SyncArea::Create(std::move(shape), MapProfile());  // tiles of 12.8 m
  EXPECT_TRUE(area.has_value()) << area.error().message();
  return *std::move(area);
}

StatusCode CodeOf(MapArea shape) {
  const auto area = SyncArea::Create(std::move(shape), MapProfile());
  return area ? StatusCode::kOk : area.error().code();
}

TEST(SyncAreaTest, ADiscTouchesWhatIsWithinItsRadius) {
  const SyncArea disc = Make(DiscArea{{6.4, 6.4}, 10.0});
  EXPECT_TRUE(disc.Touches({0, 0, 0}));
  EXPECT_TRUE(disc.Touches({0, 1, 0}));   // begins 6.4 m away
  EXPECT_TRUE(disc.Touches({0, 1, 1}));   // 9.05 m
  EXPECT_FALSE(disc.Touches({0, 2, 0}));  // 19.2 m
  EXPECT_TRUE(disc.Touches({3, 0, 0}));
  EXPECT_FALSE(disc.Touches({0, -2, 0}));  // ends 12.8 m from 0
  EXPECT_TRUE(disc.Touches({0, 0, 0}, 3));
  EXPECT_FALSE(disc.Touches({0, 8, 0}, 3));
}

TEST(SyncAreaTest, ACorridorTouchesWhatIsBesideItsRoute) {
  const SyncArea corridor = Make(CorridorArea{{{0, 0}, {1'000, 0}, {1'000, 500}}, 5.0});
  EXPECT_TRUE(corridor.Touches({0, 40, 0}));
  EXPECT_TRUE(corridor.Touches({0, 40, -1}));
  EXPECT_FALSE(corridor.Touches({0, 40, 1}));
  EXPECT_TRUE(corridor.Touches({0, 78, 30}));   // 998.4 to 1,011.2 m
  EXPECT_FALSE(corridor.Touches({0, 40, 30}));  // within its box, but off the way
  EXPECT_TRUE(corridor.Touches({0, 40, -8}, 3));
}

TEST(SyncAreaTest, ABoxAndTilesTouchWhatTheyHold) {
  const SyncArea box = Make(BoxArea{{1.0, 1.0}, {2.0, 30.0}});
  EXPECT_TRUE(box.Touches({0, 0, 0}));
  EXPECT_TRUE(box.Touches({0, 0, 2}));
  EXPECT_FALSE(box.Touches({0, 1, 0}));
  EXPECT_FALSE(box.Touches({0, 0, 3}));
  const SyncArea tiles = Make(TilesArea{{{0, 1, 1}, {0, 9, 1}, {2, 0, 0}}});
  EXPECT_TRUE(tiles.Touches({0, 1, 1}));
  EXPECT_FALSE(tiles.Touches({0, 1, 2}));
  EXPECT_TRUE(tiles.Touches({0, 0, 0}, 3));
  EXPECT_FALSE(tiles.Touches({0, 16, 0}, 3));
  EXPECT_TRUE(tiles.Touches({2, 0, 0}));
}

TEST(SyncAreaTest, TilesTakeAKeyEach) {
  std::vector<std::uint64_t> keys;
  for (std::int32_t x = 0; x < 1'000; ++x) {
    keys.push_back(TileId{0, 0, x}.Key());
  }
  const SyncArea tiles = SyncArea::OfTiles(keys, MapProfile()).value();
  EXPECT_EQ(*tiles.tile_keys(), keys);
  EXPECT_GE(tiles.bytes(), keys.size() * sizeof(std::uint64_t));
  EXPECT_LT(tiles.bytes(), keys.size() * sizeof(std::uint64_t) + 512);
  EXPECT_GE(Make(CorridorArea{std::vector<Vector2d>(256, Vector2d(1, 1)), 5.0}).bytes(), 256u * 56);
  EXPECT_LT(Make(DiscArea{{0, 0}, 5.0}).bytes(), 512u);
}

TEST(SyncAreaTest, KeysThatNoTilesHaveAreRefused) {
  const std::uint64_t key = TileId{0, 0, 0}.Key();
  const auto code = [](std::vector<std::uint64_t> keys) {
    const auto area = SyncArea::OfTiles(std::move(keys), MapProfile());
    return area ? StatusCode::kOk : area.error().code();
  };
  EXPECT_EQ(code({key, key + 1}), StatusCode::kOk);
  EXPECT_EQ(code({key + 1, key}), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({key, std::uint64_t{1} << 63}), StatusCode::kInvalidArgument);
  EXPECT_EQ(code(std::vector<std::uint64_t>(SyncArea::kMaxTiles + 1, key)),
            StatusCode::kInvalidArgument);
}

// Against points on the shape and in the tile, for random routes and tiles.
TEST(SyncAreaTest, DistancesAreThoseOfTheirPoints) {
  std::mt19937 random(1);
  const auto below = [&](double limit) {
    return limit * static_cast<double>(random() % 10'001) / 10'000;
  };
  for (int i = 0; i < 300; ++i) {
    std::vector<Vector2d> route;
    for (int n = 0; n < 2; ++n) {
      route.emplace_back(below(100.0) - 50.0, below(100.0) - 50.0);
    }
    const TileId id{static_cast<std::uint8_t>(i % 3), static_cast<std::int32_t>(random() % 8) - 4,
                    static_cast<std::int32_t>(random() % 8) - 4};
    const double side_m = 12.8 * (1 << id.level);
    double nearest_m = std::numeric_limits<double>::infinity();
    for (int at = 0; at <= 200; ++at) {
      const Vector2d point = route[0] + at / 200.0 * (route[1] - route[0]);
      const Vector2d in_tile = point.cwiseMax(side_m * Vector2d(id.x, id.y))
                                   .cwiseMin(side_m * Vector2d(id.x + 1, id.y + 1));
      nearest_m = std::min(nearest_m, (point - in_tile).norm());
    }
    const double step_m = (route[1] - route[0]).norm() / 200.0;
    EXPECT_TRUE(Make(CorridorArea{route, nearest_m + 1e-9}).Touches(id)) << i;
    if (nearest_m > step_m) {
      EXPECT_FALSE(Make(CorridorArea{route, nearest_m - step_m}).Touches(id)) << i;
    }
  }
}

TEST(SyncAreaTest, WhatLiesAheadCountsAsFartherOff) {
  const SyncArea corridor = Make(CorridorArea{{{0, 0}, {1'000, 0}}, 50.0});
  EXPECT_EQ(corridor.Distance({0, 0, 0}), 0.0);
  EXPECT_NEAR(corridor.Distance({0, 10, 0}), 0.25 * 128.0, 1e-6);
  EXPECT_LT(corridor.Distance({0, 10, 0}), corridor.Distance({0, 20, 0}));
  EXPECT_LT(corridor.Distance({0, 10, 0}), corridor.Distance({0, 10, 2}));
  EXPECT_EQ(Make(TilesArea{{{0, 5, 5}}}).Distance({0, 5, 5}), 0.0);
}

// What Bounds() leaves out is never touched.
TEST(SyncAreaTest, BoundsHoldEverything) {
  std::mt19937 random(2);
  for (int i = 0; i < 2'000; ++i) {
    const double x_m = static_cast<double>(random() % 1'000) / 10.0 - 50.0;
    const SyncArea area =
        i % 2 == 0 ? Make(DiscArea{{x_m, 12.8}, static_cast<double>(random() % 300) / 10.0})
                   : Make(BoxArea{{x_m, -12.8}, {x_m + 12.8, 25.6}});
    const TileId id{static_cast<std::uint8_t>(random() % 3),
                    static_cast<std::int32_t>(random() % 16) - 8,
                    static_cast<std::int32_t>(random() % 16) - 8};
    if (area.Touches(id)) {
      EXPECT_TRUE(area.Bounds(id.level).Contains(id)) << i;
    }
  }
}

TEST(SyncAreaTest, HostileNumbersAreRefusedOrHarmless) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(CodeOf(DiscArea{{kNan, 0}, 1.0}), StatusCode::kInvalidArgument);
  EXPECT_EQ(CodeOf(DiscArea{{0, 0}, kNan}), StatusCode::kInvalidArgument);
  EXPECT_EQ(CodeOf(DiscArea{{0, 0}, -1.0}), StatusCode::kInvalidArgument);
  EXPECT_EQ(CodeOf(BoxArea{{0, 0}, {1, -1}}), StatusCode::kInvalidArgument);
  EXPECT_EQ(CodeOf(BoxArea{{-kInf, 0}, {1, 1}}), StatusCode::kInvalidArgument);
  EXPECT_EQ(CodeOf(CorridorArea{{}, 1.0}), StatusCode::kInvalidArgument);
  EXPECT_EQ(CodeOf(CorridorArea{std::vector<Vector2d>(257, Vector2d::Zero()), 1.0}),
            StatusCode::kInvalidArgument);
  EXPECT_EQ(CodeOf(TilesArea{{{0, 1, 1}, {0, 1, 1}}}), StatusCode::kInvalidArgument);
  EXPECT_EQ(CodeOf(TilesArea{{{0, 9, 1}, {0, 1, 1}}}), StatusCode::kInvalidArgument);
  const SyncArea far = Make(DiscArea{{1e300, -1e300}, 1e300});
  const TileRect rect = far.Bounds(0);
  EXPECT_LE(rect.min_x, rect.max_x);
  EXPECT_TRUE(Make(DiscArea{{0, 0}, kInf}).Touches({0, 1'000'000, -1'000'000}));
  EXPECT_FALSE(std::isnan(far.Distance({0, TileId::kMaxCoordinate, TileId::kMinCoordinate})));
}

TEST(SyncAreaTest, EveryAreaHasAHashOfItsOwn) {
  const std::vector<MapArea> areas = {
      DiscArea{{0, 0}, 1.0},
      DiscArea{{0, 0}, 2.0},
      DiscArea{{0, 1}, 1.0},
      DiscArea{{1, 0}, 1.0},
      BoxArea{{0, 0}, {1, 0}},
      BoxArea{{0, 0}, {0, 1}},
      BoxArea{{0, 0}, {1, 1}},
      CorridorArea{{{0, 0}}, 1.0},
      CorridorArea{{{0, 0}}, 2.0},
      CorridorArea{{{0, 0}, {0, 1}}, 1.0},
      CorridorArea{{{0, 1}, {0, 0}}, 1.0},
      TilesArea{},
      TilesArea{{{0, 0, 0}}},
      TilesArea{{{0, 0, 1}}},
      TilesArea{{{0, 0, 0}, {0, 0, 1}}},
      TilesArea{{{1, 0, 0}}},
  };
  std::set<std::uint64_t> hashes;
  for (const MapArea& area : areas) {
    hashes.insert(Make(area).Hash());
    EXPECT_EQ(Make(area).Hash(), Make(area).Hash());
  }
  EXPECT_EQ(hashes.size(), areas.size());
}

}  // namespace
}  // namespace atlas
