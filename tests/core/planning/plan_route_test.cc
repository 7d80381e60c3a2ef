// Routes in tiny worlds: what joins, what blocks, and what is refused.
#include "core/planning/plan_route.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "tests/core/planning/tiny_world.h"
#include "tests/core/support/test_scale.h"

namespace atlas {
namespace {

using Rows = std::vector<std::string_view>;

double Slope(double degrees) {
  return std::tan(degrees * std::numbers::pi / 180.0);
}

bool IsFound(TinyWorld& world, const PlanOptions& options = {}) {
  const auto route = world.Plan(options);
  EXPECT_TRUE(route.has_value()) << route.error().message();
  return route && route->found;
}

double HighestStep(const Route& route) {
  double highest_m = 0.0;
  for (std::size_t i = 1; i < route.waypoints.size(); ++i) {
    highest_m = std::max(highest_m, std::abs(route.waypoints[i].z() - route.waypoints[i - 1].z()));
  }
  return highest_m;
}

const Rows kCorridor = {
    "........................",  //
    "........................",  //
    "..S..................G..",  //
    "........................",  //
    "........................",
};

TEST(PlanRouteTest, StraightOnAFlatFloor) {
  TinyWorld world;
  world.Draw(kCorridor, 1.0);
  const auto route = world.Plan();
  ASSERT_TRUE(route.has_value());
  ASSERT_TRUE(route->found);
  EXPECT_NEAR(route->length_m, 9.5, 0.2);
  EXPECT_GE(route->cost, route->length_m - 0.2);
  EXPECT_LT((route->waypoints.front() - world.start()).norm(), 0.2);
  EXPECT_LT((route->waypoints.back() - world.goal()).norm(), 0.2);
  EXPECT_GT(route->expansions, 0U);
  EXPECT_EQ(route->tiles_loaded, world.tiles());
}

TEST(PlanRouteTest, PointsOfASensorStandOnTheSurfaceBelow) {
  TinyWorld world;
  world.Draw(kCorridor, 0.0);
  world.Draw(kCorridor, 3.2);
  const Eigen::Vector3d sensor(0.0, 0.0, 1.8);
  const auto route = PlanRoute(world, world.profile(),
                               {world.start() - Eigen::Vector3d(0, 0, 3.2) + sensor,
                                world.goal() - Eigen::Vector3d(0, 0, 3.2) + sensor,
                                {}});
  ASSERT_TRUE(route.has_value());
  ASSERT_TRUE(route->found);
  EXPECT_NEAR(route->waypoints.front().z(), 0.0, 1e-9);
  EXPECT_NEAR(route->waypoints.back().z(), 0.0, 1e-9);
}

TEST(PlanRouteTest, PointsOfALorrysSensorStandFartherBelowButNotOnAnotherDeck) {
  const auto plan = [](TinyWorld& world, double height_m) {
    const Eigen::Vector3d sensor(0.0, 0.0, height_m);
    return PlanRoute(world, world.profile(), {world.start() + sensor, world.goal() + sensor, {}});
  };
  TinyWorld yard;
  yard.Draw(kCorridor, 0.0);
  for (const double height_m : {1.0, 3.0, 4.4}) {
    const auto route = plan(yard, height_m);
    ASSERT_TRUE(route.has_value()) << height_m;
    EXPECT_TRUE(route->found) << height_m;
  }
  const auto refused = plan(yard, 5.0);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code(), StatusCode::kNotFound);
  // Its own deck has a hole right below it: the vehicle is moved across, not down to the next one.
  TinyWorld decks;
  decks.Draw(kCorridor, 0.0);
  decks.Draw({"........................",  //
              "........................",  //
              " .S..................G..",  //
              "........................",  //
              "........................"},
             2.6);
  const auto route = PlanRoute(decks, decks.profile(),
                               {decks.start() + Eigen::Vector3d(-1.0, 0.0, 1.5), decks.goal(), {}});
  ASSERT_TRUE(route.has_value());
  ASSERT_TRUE(route->found);
  EXPECT_NEAR(route->waypoints.front().z(), 2.6, 1e-9);
}

// Deck 0 in the west, a ramp from x = 5 m to x = 15 m, deck 1 in the east.
TinyWorld TwoDecks(double ramp_deg) {
  TinyWorld decks;
  const double height_m = 10.0 * Slope(ramp_deg);
  const auto surface = [height_m](double x_m, double) {
    return height_m * std::clamp((x_m - 5.0) / 10.0, 0.0, 1.0);
  };
  decks.Draw({"..........                    ....................",
              "..........                    ....................",
              "..................................................",
              "..S............................................G..",
              "..................................................",
              "..........                    ....................",
              "..........                    ...................."},
             surface);
  return decks;
}

TEST(PlanRouteTest, ARampJoinsTwoDecksWithoutAHighStep) {
  TinyWorld world = TwoDecks(16.0);
  const auto route = world.Plan();
  ASSERT_TRUE(route.has_value());
  ASSERT_TRUE(route->found);
  EXPECT_NEAR(route->waypoints.back().z() - route->waypoints.front().z(), 10.0 * Slope(16.0), 0.01);
  EXPECT_LE(HighestStep(*route), 0.2);
}

TEST(PlanRouteTest, SlopeLimitDecidesOnTheRamp) {
  TinyWorld world = TwoDecks(12.0);
  PlanOptions options;
  for (const double limit_deg : {5.0, 8.0, 11.0}) {
    options.max_slope_deg = limit_deg;
    EXPECT_FALSE(IsFound(world, options)) << limit_deg;
  }
  for (const double limit_deg : {13.0, 20.0, 25.0}) {
    options.max_slope_deg = limit_deg;
    EXPECT_TRUE(IsFound(world, options)) << limit_deg;
  }
}

TEST(PlanRouteTest, NoiseOfThreeCentimetresIsNotASlopeOfFiveDegrees) {
  TinyWorld world;
  std::mt19937 random(7);
  std::normal_distribution<double> noise_m(0.0, 0.03);
  world.Draw(kCorridor, [&](double, double) { return noise_m(random); });
  PlanOptions options;
  options.max_slope_deg = 5.0;
  EXPECT_TRUE(IsFound(world, options));
}

TEST(PlanRouteTest, ABridgeIsNotJoinedToTheRoadBelow) {
  const Rows road = {
      "........................",  //
      "........................",  //
      "..S.....................",  //
      "........................",  //
      "........................",
  };
  const Rows bridge = {
      "         .....          ",  //
      "         .....          ",  //
      "         ..G..          ",  //
      "         .....          ",  //
      "         .....          ",
  };
  TinyWorld world;
  world.Draw(road, 0.0);
  world.Draw(bridge, 5.5);
  const auto route = world.Plan();
  ASSERT_TRUE(route.has_value());
  EXPECT_FALSE(route->found);
  EXPECT_EQ(route->length_m, 0.0);
  EXPECT_EQ(route->cost, 0.0);
  EXPECT_TRUE(route->waypoints.empty());
}

// The road is layer 0 everywhere, then layer 1 where a cellar lies below it: never by index.
TEST(PlanRouteTest, TheRoadGoesOnWhereItsLayerNumberChanges) {
  TinyWorld world;
  world.Draw({"        ........        ",  //
              "        ........        ",  //
              "        ........        ",  //
              "        ........        ",  //
              "        ........        "},
             -3.0);
  world.Draw(kCorridor, 0.0);
  const auto route = world.Plan();
  ASSERT_TRUE(route.has_value());
  ASSERT_TRUE(route->found);
  for (const Eigen::Vector3d& waypoint : route->waypoints) {
    EXPECT_EQ(waypoint.z(), 0.0);
  }
}

TEST(PlanRouteTest, AStepHigherThanTheLimitBlocks) {
  const auto found_over = [](double step_m, double limit_m) {
    TinyWorld world;
    world.Draw(kCorridor, [&](double x_m, double) { return x_m < 6.0 ? 0.0 : step_m; });
    PlanOptions options;
    options.max_step_m = limit_m;
    return IsFound(world, options);
  };
  EXPECT_TRUE(found_over(0.12, 0.2));  // a curb
  EXPECT_TRUE(found_over(-0.12, 0.2));
  EXPECT_FALSE(found_over(0.12, 0.1));
  EXPECT_FALSE(found_over(0.3, 0.2));
  EXPECT_FALSE(found_over(-0.3, 0.2));
}

const Rows kGap = {
    "............##............",  //
    "............##............",  //
    "............##............",  //
    "..S....................G..",  //
    "..........................",  //
    "..........................",  //
    "............##............",  //
    "............##............",  //
    "............##............",
};

TEST(PlanRouteTest, AVehicleFitsThroughAGapWiderThanItself) {
  TinyWorld world;
  world.Draw(kGap, 0.0);  // the gap is 1.5 m wide
  PlanOptions options;
  EXPECT_FALSE(IsFound(world, options));
  options.vehicle_width_m = 1.0;
  EXPECT_TRUE(IsFound(world, options));
  options.safety_margin_m = 0.5;
  EXPECT_FALSE(IsFound(world, options));
}

TEST(PlanRouteTest, ObstaclesInflateTheirOwnDeckOnly) {
  TinyWorld world;
  world.Draw({"............##............",  //
              "............##............",  //
              "............##............",  //
              "............##............",  //
              "............##............"},
             -3.2);
  world.Draw({"..........................",  //
              "..........................",  //
              "..S....................G..",  //
              "..........................",  //
              ".........................."},
             0.0);
  EXPECT_TRUE(IsFound(world));
}

TEST(PlanRouteTest, RoutesKeepAwayFromWallsWhereThereIsRoom) {
  TinyWorld world;
  world.Draw({"....................",  //
              "....................",  //
              "....................",  //
              "....................",  //
              "..S..............G..",  //
              "....................",  //
              "##..##..##..##..##.."},
             0.0);
  PlanOptions options;
  const auto distance_to_wall = [&] {
    const auto route = world.Plan(options);
    EXPECT_TRUE(route && route->found);
    double lowest_m = 100.0;
    for (const Eigen::Vector3d& waypoint : route->waypoints) {
      lowest_m =
          std::min(lowest_m, std::abs(waypoint.x() - 5.0) < 2.0 ? waypoint.y() - 0.5 : 100.0);
    }
    return lowest_m;
  };
  options.comfort_weight = 0.0;
  EXPECT_GT(distance_to_wall(), 0.9);
  options.comfort_weight = 5.0;
  EXPECT_GT(distance_to_wall(), 1.35);
}

TEST(PlanRouteTest, HeadroomUnderALowBridge) {
  const auto found_below = [](double bridge_m, double headroom_m) {
    TinyWorld world;
    world.Draw(kCorridor, 0.0);
    world.Draw({"          ....          ",  //
                "          ....          ",  //
                "          ....          ",  //
                "          ....          ",  //
                "          ....          "},
               bridge_m);
    PlanOptions options;
    options.headroom_m = headroom_m;
    return IsFound(world, options);
  };
  EXPECT_TRUE(found_below(5.5, 2.0));
  EXPECT_TRUE(found_below(2.5, 2.0));
  EXPECT_FALSE(found_below(2.1, 2.0));  // the slab takes 0.3 m
  EXPECT_FALSE(found_below(3.5, 3.6));
}

TEST(PlanRouteTest, WhatHangsInAColumnBlocksBelowTheHeadroom) {
  TinyWorld world;
  world.Draw({"..........cc............",  //
              "..........cc............",  //
              "..S.......cc.........G..",  //
              "..........cc............",  //
              "..........cc............"},
             0.0);
  PlanOptions options;
  EXPECT_FALSE(IsFound(world, options));
  options.headroom_m = 1.2;
  EXPECT_TRUE(IsFound(world, options));
}

TEST(PlanRouteTest, AFaintSurfaceOverheadDoesNotCloseTheLane) {
  TinyWorld world;
  world.Draw(kCorridor, 0.0);
  TileLayer ghost = FreeLayer(1.7);
  ghost.sigma_100um = 6000;
  ghost.observations = 4;
  for (std::int64_t y = 0; y < 25; ++y) {
    world.Put(60, y, ghost);
  }
  EXPECT_TRUE(IsFound(world));
}

TEST(PlanRouteTest, UnknownIsNotTraversable) {
  TinyWorld seen;
  seen.Draw({"..........??............",  //
             "..........??............",  //
             "..S.......??.........G..",  //
             "..........??............",  //
             "..........??............"},
            0.0);
  EXPECT_FALSE(IsFound(seen));
  TinyWorld unseen;
  unseen.Draw({"..........  ............",  //
               "..........  ............",  //
               "..S.......  .........G..",  //
               "..........  ............",  //
               "..........  ............"},
              0.0);
  EXPECT_FALSE(IsFound(unseen));
}

TEST(PlanRouteTest, SparseMapsAreCrossed) {
  TinyWorld world;
  std::mt19937 random(11);
  for (std::int64_t y = 0; y < 40; ++y) {
    for (std::int64_t x = 0; x < 300; ++x) {
      if (random() % 100 >= 35) {
        world.Put(x, y, FreeLayer(0.0));
      }
    }
  }
  const auto route = PlanRoute(world, world.profile(), {{2.0, 2.0, 0.0}, {28.0, 2.0, 0.0}, {}});
  ASSERT_TRUE(route.has_value()) << route.error().message();
  EXPECT_TRUE(route->found);
  EXPECT_LT(route->length_m, 28.0);
}

TEST(PlanRouteTest, CostIsTheSameBothWaysInRandomWorlds) {
  PlanOptions options;
  options.comfort_weight = 0.0;
  options.vehicle_width_m = 0.4;
  int found = 0;
  for (std::uint32_t seed = 0; seed < testing::Scaled(30); ++seed) {
    TinyWorld world;
    std::mt19937 random(seed);
    for (std::int64_t y = 0; y < 60; ++y) {
      for (std::int64_t x = 0; x < 60; ++x) {
        TileLayer layer = FreeLayer(1e-3 * static_cast<double>(random() % 150));
        layer.occupancy = random() % 60 == 0 && x > 8 && x < 52 ? 64 : -64;
        world.Put(x, y, layer);
      }
    }
    const Eigen::Vector3d a(0.4, 0.4, 0.0);
    const Eigen::Vector3d b(5.5, 5.5, 0.0);
    const auto there = PlanRoute(world, world.profile(), {a, b, options});
    const auto back = PlanRoute(world, world.profile(), {b, a, options});
    ASSERT_TRUE(there.has_value() && back.has_value()) << seed;
    ASSERT_EQ(there->found, back->found) << seed;
    EXPECT_NEAR(there->searched_cost, back->searched_cost, 1e-3) << seed;
    found += there->found ? 1 : 0;
  }
  EXPECT_GT(found, static_cast<int>(testing::Scaled(30) / 6));
}

TEST(PlanRouteTest, AGoalThisVehicleMayNotStandOnIsNoRoute) {
  TinyWorld world;
  world.Draw(kCorridor, [](double x_m, double) { return std::max(0.0, x_m - 6.0) * Slope(20.0); });
  PlanOptions options;
  EXPECT_TRUE(IsFound(world, options));
  options.max_slope_deg = 5.0;
  EXPECT_FALSE(IsFound(world, options));
}

}  // namespace
}  // namespace atlas
