// What planning loads, what it refuses, and where it stops.
#include <limits>

#include <gtest/gtest.h>

#include "core/planning/plan_route.h"
#include "tests/core/planning/tiny_world.h"

namespace atlas {
namespace {

TEST(PlanLimitsTest, TilesAreLoadedAsNeeded) {
  TinyWorld world;
  for (std::int64_t y = 0; y < 320; ++y) {
    for (std::int64_t x = 0; x < 640; ++x) {
      world.Put(x, y, FreeLayer(0.0));
    }
  }
  const auto route = PlanRoute(world, world.profile(), {{5.0, 16.0, 0.0}, {8.0, 16.0, 0.0}, {}});
  ASSERT_TRUE(route && route->found);
  EXPECT_LE(route->tiles_loaded, 30U);
  EXPECT_GE(world.tiles(), 200U);
  EXPECT_GE(world.tiles_asked(), route->tiles_loaded);
}

TEST(PlanLimitsTest, ExceededBudgetsAreTyped) {
  TinyWorld world;
  world.Draw(kCorridor, 0.0);
  PlanOptions options;
  options.max_expansions = 20;
  const auto few = world.Plan(options);
  ASSERT_FALSE(few.has_value());
  EXPECT_EQ(few.error().code(), StatusCode::kResourceExhausted);
  options = {};
  options.max_memory_bytes = 10'000;
  const auto small = world.Plan(options);
  ASSERT_FALSE(small.has_value());
  EXPECT_EQ(small.error().code(), StatusCode::kResourceExhausted);
}

TEST(PlanLimitsTest, NoBudgetAtAllIsAMistake) {
  TinyWorld world;
  world.Draw(kCorridor, 0.0);
  PlanOptions without[3];
  without[0].max_expansions = 0;
  without[1].max_memory_bytes = 0;
  without[2].max_time_s = 0.0;
  for (const PlanOptions& options : without) {
    const auto route = world.Plan(options);
    ASSERT_FALSE(route.has_value());
    EXPECT_EQ(route.error().code(), StatusCode::kInvalidArgument) << route.error().message();
  }
}

TEST(PlanLimitsTest, TimeIsLimitedByTheClockThatIsPassedIn) {
  TinyWorld world;
  world.Draw(kCorridor, 0.0);
  PlanRequest request{world.start(), world.goal(), {}};
  request.options.max_time_s = 2.0;
  double now_s = 100.0;
  request.now_s = [&now_s] {
    return now_s += 0.5;
  };  // whenever it is asked
  const auto late = PlanRoute(world, world.profile(), request);
  ASSERT_FALSE(late.has_value());
  EXPECT_EQ(late.error().code(), StatusCode::kTimeout);
  request.options.max_time_s = 1e6;
  EXPECT_TRUE(PlanRoute(world, world.profile(), request).has_value());
  request.options.max_time_s = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(PlanRoute(world, world.profile(), request).error().code(),
            StatusCode::kInvalidArgument);
}

TEST(PlanLimitsTest, UnknownIsDrivenOverOnlyWhereItIsAllowed) {
  TinyWorld world;
  world.Draw({"..........??............",  //
              "..........??............",  //
              "..S.......??.........G..",  //
              "..........??............",  //
              "..........??............"},
             0.0);
  world.BuildPyramid();
  PlanOptions options;
  EXPECT_FALSE(world.Plan(options)->found);
  options.allow_unknown = true;
  EXPECT_TRUE(world.Plan(options)->found);
}

TEST(PlanLimitsTest, NoSurfaceAtAnEndIsNotFoundAndSaysWhich) {
  TinyWorld world;
  world.Draw(kCorridor, 0.0);
  const auto plan = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    const auto route = PlanRoute(world, world.profile(), {from, to, {}});
    EXPECT_FALSE(route.has_value());
    return route ? Status() : route.error();
  };
  const Status start = plan({-50.0, 0.0, 0.0}, world.goal());
  EXPECT_EQ(start.code(), StatusCode::kNotFound);
  EXPECT_NE(start.message().find("start"), std::string::npos) << start.message();
  const Status goal = plan(world.start(), world.goal() + Eigen::Vector3d(0.0, 0.0, 5.0));
  EXPECT_EQ(goal.code(), StatusCode::kNotFound);
  EXPECT_NE(goal.message().find("goal"), std::string::npos) << goal.message();
}

TEST(PlanLimitsTest, BadRequestsAreRefused) {
  TinyWorld world;
  world.Draw(kCorridor, 0.0);
  const auto code = [&](const Eigen::Vector3d& from, const PlanOptions& options) {
    const auto route = PlanRoute(world, world.profile(), {from, world.goal(), options});
    return route ? StatusCode::kOk : route.error().code();
  };
  EXPECT_EQ(code({std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0}, {}),
            StatusCode::kInvalidArgument);
  EXPECT_EQ(code({1e12, 0.0, 0.0}, {}), StatusCode::kInvalidArgument);
  PlanOptions options;
  options.max_slope_deg = -1.0;
  EXPECT_EQ(code(world.start(), options), StatusCode::kInvalidArgument);
  options = {};
  options.vehicle_width_m = 9.0;  // reaches beyond the neighbouring tile of 3.2 m
  EXPECT_EQ(code(world.start(), options), StatusCode::kInvalidArgument);
}

TEST(PlanLimitsTest, ErrorsOfTheTileSourceAreHandedOn) {
  TinyWorld world;
  world.Draw(kCorridor, 0.0);
  world.FailFrom(Status(StatusCode::kUnavailable, "the link is down"));
  const auto route = world.Plan();
  ASSERT_FALSE(route.has_value());
  EXPECT_EQ(route.error().code(), StatusCode::kUnavailable);
  EXPECT_NE(route.error().message().find("the link is down"), std::string::npos);
}

TEST(PlanLimitsTest, ATileOfAnotherProfileIsInvalidData) {
  TinyWorld world;
  world.Draw(kCorridor, 0.0);
  MapProfile other = world.profile();
  other.tile_cells = 64;
  const auto route = PlanRoute(world, other, {world.start(), world.goal(), {}});
  ASSERT_FALSE(route.has_value());
  EXPECT_EQ(route.error().code(), StatusCode::kInvalidData);
}

}  // namespace
}  // namespace atlas
