// Random worlds with walls, kerbs, holes and a deck above: what a search along a corridor finds
// against a search over everything, and whether routes keep their vehicle's limits.
#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include <gtest/gtest.h>

#include "core/planning/plan_route.h"
#include "tests/core/planning/tiny_world.h"
#include "tests/core/support/test_scale.h"

namespace atlas {
namespace {

constexpr std::int64_t kSide = 220;  // cells of 0.1 m

// Rooms of 4 m whose walls have doors here and there, ground that rises and falls, cells that were
// never seen, a bridge across the middle.
class RandomWorld {
 public:
  explicit RandomWorld(std::uint32_t seed) : random_(seed) {
    const double rise = 0.05 * static_cast<double>(random_() % 4);
    for (std::int64_t y = 0; y < kSide; ++y) {
      for (std::int64_t x = 0; x < kSide; ++x) {
        if (random_() % 25 == 0) continue;
        const double z_m = rise * std::sin(0.03 * static_cast<double>(x + 2 * y));
        TileLayer layer = FreeLayer(z_m + (IsKerbed(x, y) ? 0.12 : 0.0));
        layer.occupancy = IsWall(x, y) ? 64 : -64;
        if (IsWall(x, y)) layer.flags = TileLayer::kMeasured;
        world.Put(x, y, layer);
        if (y > 100 && y < 130) world.Put(x, y, FreeLayer(z_m + 5.0));
      }
    }
    world.BuildPyramid();
  }

  Eigen::Vector3d Place() {
    const auto m = [this] {
      return 0.1 * (static_cast<double>(random_() % kSide) + 0.5);
    };
    return {m(), m(), 0.0};
  }

  TinyWorld world;

 private:
  static bool IsKerbed(std::int64_t x, std::int64_t) { return x / 55 % 2 == 1; }
  bool IsWall(std::int64_t x, std::int64_t y) {
    const bool is_wall = x % 40 == 0 || y % 40 == 0;
    return is_wall && !HasDoor(x / 40, y / 40, x % 40 == 0, x % 40 == 0 ? y % 40 : x % 40);
  }
  bool HasDoor(std::int64_t x, std::int64_t y, bool is_upright, std::int64_t along) {
    const std::int64_t key = (x * 100 + y) * 2 + (is_upright ? 1 : 0);
    const auto [door, is_new] = doors_.try_emplace(key, 0);
    if (is_new) door->second = static_cast<std::int64_t>(random_() % 40) - 12;  // some have none
    return along > door->second && along < door->second + 12 && door->second >= 0;
  }

  std::mt19937 random_;
  std::map<std::int64_t, std::int64_t> doors_;
};

PlanOptions SmallVehicle(std::uint32_t seed) {
  PlanOptions options;
  options.vehicle_width_m = seed % 2 == 0 ? 0.6 : 0.3;
  options.comfort_weight = seed % 3 == 0 ? 0.0 : 1.0;
  return options;
}

TEST(CorridorTest, RoutesCostWithinTwoPercentOfASearchOverEverything) {
  int found = 0;
  for (std::uint32_t seed = 0; seed < testing::Scaled(30); ++seed) {
    RandomWorld random(seed);
    PlanRequest request{random.Place(), random.Place(), SmallVehicle(seed)};
    const auto route = PlanRoute(random.world, random.world.profile(), request);
    request.options.is_exhaustive = true;
    const auto all = PlanRoute(random.world, random.world.profile(), request);
    ASSERT_EQ(route.has_value(), all.has_value()) << seed;
    if (!route) continue;
    ASSERT_EQ(route->found, all->found) << seed;
    // Ways of a few metres may differ by a cell at either end.
    EXPECT_LE(route->searched_cost, 1.02 * all->searched_cost + 0.2) << seed;
    found += route->found ? 1 : 0;
  }
  EXPECT_GT(found, static_cast<int>(testing::Scaled(30) / 4));
}

TEST(CorridorTest, StraighteningNeverCostsMoreAndKeepsTheLimits) {
  for (std::uint32_t seed = 0; seed < testing::Scaled(20); ++seed) {
    RandomWorld random(seed);
    const PlanRequest request{random.Place(), random.Place(), SmallVehicle(seed)};
    const auto route = PlanRoute(random.world, random.world.profile(), request);
    if (!route || !route->found) continue;
    EXPECT_LE(route->cost, route->searched_cost + 1e-6) << seed;
    ASSERT_EQ(route->clearance_m.size(), route->waypoints.size());
    ASSERT_EQ(route->slope_deg.size(), route->waypoints.size());
    for (std::size_t i = 0; i < route->waypoints.size(); ++i) {
      EXPECT_GT(route->clearance_m[i], request.options.inflation_m()) << seed;
      EXPECT_LE(route->slope_deg[i], request.options.max_slope_deg) << seed;
      EXPECT_LT(route->waypoints[i].z(), 2.0) << seed;  // never on the bridge
      if (i > 0) {
        const double rise_m = route->waypoints[i].z() - route->waypoints[i - 1].z();
        EXPECT_LE(std::abs(rise_m), request.options.max_step_m + 1e-9) << seed;
      }
    }
  }
}

// Every point of every line keeps off the walls, not only the waypoints.
TEST(CorridorTest, LinesBetweenWaypointsKeepOffObstacles) {
  TinyWorld world;
  world.Draw({"..................................",  //
              "..S...............................",  //
              "..........####....................",  //
              "..........####.........####.......",  //
              ".......................####.......",  //
              "..............................G...",  //
              ".................................."},
             0.0);
  world.BuildPyramid();
  const auto route = world.Plan();
  ASSERT_TRUE(route && route->found);
  const auto off_m = [](const Eigen::Vector2d& p, double x0, double x1, double y0, double y1) {
    return std::hypot(std::max({x0 - p.x(), 0.0, p.x() - x1}),
                      std::max({y0 - p.y(), 0.0, p.y() - y1}));
  };
  for (std::size_t i = 1; i < route->waypoints.size(); ++i) {
    for (double share = 0.0; share <= 1.0; share += 0.05) {
      const Eigen::Vector2d p =
          ((1.0 - share) * route->waypoints[i - 1] + share * route->waypoints[i]).head<2>();
      // Half a cell: clearance is told between cells' middles.
      EXPECT_GT(off_m(p, 5.0, 7.0, 1.5, 2.5), 0.85);
      EXPECT_GT(off_m(p, 11.5, 13.5, 1.0, 2.0), 0.85);
    }
  }
  EXPECT_LT(route->cost, route->searched_cost - 0.1);
}

TEST(CorridorTest, FewerNodesAreExpandedWhereThereAreManyWays) {
  TinyWorld world;
  for (std::int64_t y = 0; y < 400; ++y) {
    for (std::int64_t x = 0; x < 1200; ++x) {
      TileLayer layer = FreeLayer(0.0);
      const bool is_house = x % 200 >= 60 && y % 130 >= 60;
      if (is_house) {
        layer.occupancy = 64;
        layer.flags = TileLayer::kMeasured;
      }
      world.Put(x, y, layer);
    }
  }
  world.BuildPyramid();
  PlanRequest request{{3.0, 3.0, 0.0}, {103.0, 35.0, 0.0}, {}};
  const auto route = PlanRoute(world, world.profile(), request);
  request.options.is_exhaustive = true;
  const auto all = PlanRoute(world, world.profile(), request);
  ASSERT_TRUE(route && route->found && all && all->found);
  EXPECT_LE(route->searched_cost, 1.02 * all->searched_cost);
  EXPECT_LT(2 * route->expansions, all->expansions);
}

// A kerb that the coarser levels take for a way all along, and a ramp far aside: lanes straight
// over the kerb lead nowhere, so that others have to be found.
TEST(CorridorTest, LanesThatLeadNowhereAreNotTheLast) {
  constexpr double kKerb_m = 0.25;
  TinyWorld world;
  for (std::int64_t y = 0; y < 300; ++y) {
    for (std::int64_t x = 0; x < 600; ++x) {
      const double up = y >= 260 && y < 290
                            ? std::clamp(static_cast<double>(x - 270) / 60.0, 0.0, 1.0)
                            : (x >= 300 ? 1.0 : 0.0);
      world.Put(x, y, FreeLayer(kKerb_m * up));
    }
  }
  world.BuildPyramid();
  PlanRequest request{{3.0, 5.0, 0.0}, {57.0, 5.0, 0.0}, SmallVehicle(0)};
  request.options.max_slope_deg = 30.0;
  const auto route = PlanRoute(world, world.profile(), request);
  request.options.is_exhaustive = true;
  const auto all = PlanRoute(world, world.profile(), request);
  ASSERT_TRUE(route && route->found && all && all->found);
  EXPECT_GT(all->searched_cost, 65.0) << "by the ramp";
  EXPECT_LE(route->searched_cost, 1.02 * all->searched_cost);
  EXPECT_LT(route->expansions, 3 * all->expansions);
}

TEST(CorridorTest, AGoalThatIsShutInIsToldWithoutASearchOverEverything) {
  TinyWorld world;
  for (std::int64_t y = 0; y < 400; ++y) {
    for (std::int64_t x = 0; x < 400; ++x) {
      TileLayer layer = FreeLayer(0.0);
      const std::int64_t rim = std::max(std::abs(x - 350), std::abs(y - 350));
      if (rim >= 20 && rim < 23) {
        layer.occupancy = 64;
        layer.flags = TileLayer::kMeasured;
      }
      world.Put(x, y, layer);
    }
  }
  world.BuildPyramid();
  const auto route = PlanRoute(world, world.profile(), {{5.0, 5.0, 0.0}, {35.05, 35.05, 0.0}, {}});
  ASSERT_TRUE(route.has_value()) << route.error().message();
  EXPECT_FALSE(route->found);
  EXPECT_LT(route->expansions, 60'000U);
}

}  // namespace
}  // namespace atlas
