#include "client/merge/serve/merge_limits.h"

#include <limits>
#include <numbers>

#include <gtest/gtest.h>

namespace atlas {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

Pose Placed(double x_m, double yaw_rad) {
  Pose pose = Pose::Identity();
  pose.translation().x() = x_m;
  pose.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return pose;
}

// Of one session with three keyframes, of which the last one goes to `place`.
MergeRun Moved(bool is_staged, const Pose& place) {
  MergeRun run;
  run.sessions.emplace_back().key = {"car", "day"};
  run.sessions[0].is_staged = is_staged;
  run.sessions[0].keyframes.resize(3);
  SessionOutcome& outcome = run.plan.sessions.emplace_back();
  outcome.is_joined = true;
  outcome.moved.push_back({1, QuantizedPose::FromPose(Placed(0.01, 0.0))});
  outcome.moved.push_back({2, QuantizedPose::FromPose(place)});
  return run;
}

std::string BreachOf(const MergeRun& run, const MergeLimits& limits) {
  const std::vector<LimitBreach> breaches = CheckLimits(run, limits);
  return breaches.empty() ? "" : breaches.front().what;
}

TEST(MergeLimitsTest, WhatIsInTheMapMovesLittle) {
  const MergeLimits limits;
  EXPECT_EQ(BreachOf(Moved(false, Placed(0.499, 0.0)), limits), "");
  EXPECT_EQ(BreachOf(Moved(false, Placed(0.512, 0.0)), limits),
            "session car/day would move by 0.512 m, at most 0.5");
  EXPECT_EQ(BreachOf(Moved(false, Placed(0.0, 0.99 * kDegree)), limits), "");
  EXPECT_EQ(BreachOf(Moved(false, Placed(0.0, -1.25 * kDegree)), limits),
            "session car/day would turn by 1.25 degrees, at most 1");
  const std::vector<LimitBreach> breaches = CheckLimits(Moved(false, Placed(9.0, 1.0)), limits);
  ASSERT_EQ(breaches.size(), 1U);
  EXPECT_EQ(breaches[0].sessions, (std::vector<SessionKey>{{"car", "day"}}));
}

TEST(MergeLimitsTest, WhatIsStagedMovesFarther) {
  const MergeLimits limits;
  EXPECT_EQ(BreachOf(Moved(true, Placed(999.0, 3.0)), limits), "");
  EXPECT_EQ(BreachOf(Moved(true, Placed(1'001.5, 0.0)), limits),
            "staged session car/day would move by 1001.5 m, at most 1000");
}

TEST(MergeLimitsTest, AllMayBeForbidden) {
  const MergeLimits limits{.max_move_m = 0.0, .max_turn_rad = 0.0};
  EXPECT_NE(BreachOf(Moved(false, Placed(0.0, 0.0)), limits), "");
  MergeRun run = Moved(false, Placed(0.0, 0.0));
  run.plan.sessions[0].moved.clear();
  EXPECT_EQ(BreachOf(run, limits), "");
}

TEST(MergeLimitsTest, TilesAreCounted) {
  MergeRun run = Moved(true, Placed(1.0, 0.0));
  for (int x = 0; x < 3; ++x) run.plan.tiles.insert(TileId{0, x, 0});
  EXPECT_EQ(BreachOf(run, {.max_tiles = 3}), "");
  const std::vector<LimitBreach> breaches = CheckLimits(run, {.max_tiles = 2});
  ASSERT_EQ(breaches.size(), 1U);
  EXPECT_EQ(breaches[0].what, "3 tiles would change, at most 2");
  EXPECT_TRUE(breaches[0].sessions.empty());
}

TEST(MergeLimitsTest, LimitsAreNumbers) {
  EXPECT_TRUE(MergeLimits().Validate().ok());
  EXPECT_TRUE((MergeLimits{0.0, 0.0, 0.0, 0}.Validate().ok()));
  for (const double wrong : {-0.1, std::numeric_limits<double>::quiet_NaN()}) {
    for (const MergeLimits& limits :
         {MergeLimits{.max_move_m = wrong}, MergeLimits{.max_turn_rad = wrong},
          MergeLimits{.max_staged_move_m = wrong}}) {
      EXPECT_EQ(limits.Validate().code(), StatusCode::kInvalidArgument) << wrong;
    }
  }
}

}  // namespace
}  // namespace atlas
