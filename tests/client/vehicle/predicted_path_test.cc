// Properties of the path, of motions at random.
#include "client/vehicle/predicted_path.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "core/geometry/map_area.h"

namespace atlas {
namespace {

using Path = std::vector<Eigen::Vector2d>;

constexpr double kSpacing_m = 6.4;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The motion in small steps, each straight on at its middle heading.
Eigen::Vector2d Integrated(const PlanarMotion& motion, double time_s) {
  constexpr int kSteps = 20'000;
  const double step_s = time_s / kSteps;
  Eigen::Vector2d place_m = motion.position_m;
  for (int step = 0; step < kSteps; ++step) {
    const double heading_rad =
        motion.heading_rad + motion.yaw_rate_rad_s * step_s * (static_cast<double>(step) + 0.5);
    place_m +=
        motion.speed_m_s * step_s * Eigen::Vector2d(std::cos(heading_rad), std::sin(heading_rad));
  }
  return place_m;
}

class PredictedPathTest : public testing::Test {
 protected:
  double Between(double least, double most) {
    return std::uniform_real_distribution<double>(least, most)(random_);
  }
  PlanarMotion AnyMotion() {
    return {{Between(-1e4, 1e4), Between(-1e4, 1e4)},
            Between(-4.0, 4.0),
            Between(-10.0, 40.0),
            Between(-0.5, 0.5)};
  }

  std::mt19937_64 random_{17};
};

TEST_F(PredictedPathTest, ItIsTheIntegralOfTheMotion) {
  for (int trial = 0; trial < 50; ++trial) {
    const PlanarMotion motion = AnyMotion();
    const double horizon_s = Between(0.1, 12.0);
    const Path path_m = *PredictedPath(motion, horizon_s);
    EXPECT_EQ(path_m.front(), motion.position_m);
    EXPECT_LT((path_m.back() - Integrated(motion, horizon_s)).norm(), 1e-3);
  }
}

// Of an arc all chords of the same part are as long, and no longer than the part.
TEST_F(PredictedPathTest, PointsAreEvenlyApartAndAtMostASpacing) {
  for (int trial = 0; trial < 500; ++trial) {
    const Path path_m = *PredictedPath(AnyMotion(), Between(0.5, 12.0));
    ASSERT_GE(path_m.size(), 2U);
    const double first_m = (path_m[1] - path_m[0]).norm();
    EXPECT_LE(first_m, kSpacing_m);
    for (std::size_t i = 1; i < path_m.size(); ++i) {
      EXPECT_NEAR((path_m[i] - path_m[i - 1]).norm(), first_m, 1e-6);
    }
  }
}

TEST_F(PredictedPathTest, APartOfTheHorizonIsAPartOfThePath) {
  for (int trial = 0; trial < 100; ++trial) {
    PlanarMotion motion = AnyMotion();
    motion.speed_m_s = 20.0;
    const Path whole_m = *PredictedPath(motion, 10.24);  // 32 parts of a spacing
    const Path half_m = *PredictedPath(motion, 5.12);
    ASSERT_EQ(whole_m.size(), 33U);
    ASSERT_EQ(half_m.size(), 17U);
    for (std::size_t i = 0; i < half_m.size(); ++i) {
      EXPECT_LT((half_m[i] - whole_m[i]).norm(), 1e-6);
    }
  }
}

TEST_F(PredictedPathTest, AHardlyTurningVehicleGoesStraightOn) {
  for (const double yaw_rate_rad_s : {0.0, 1e-300, -1e-12, 1e-9}) {
    const Path path_m = *PredictedPath({{1.0, 2.0}, 0.0, 10.0, yaw_rate_rad_s}, 5.0);
    EXPECT_LT((path_m.back() - Eigen::Vector2d(51.0, 2.0)).norm(), 1e-6);
  }
}

TEST_F(PredictedPathTest, LeftIsCounterclockwiseAndBackwardsIsBehind) {
  const double quarter_rad_s = std::numbers::pi / 2.0;
  const auto end = [](const PlanarMotion& motion) {
    return PredictedPath(motion, 1.0)->back();
  };
  const double radius_m = 10.0 / quarter_rad_s;
  EXPECT_LT((end({{0, 0}, 0.0, 10.0, quarter_rad_s}) - Eigen::Vector2d(radius_m, radius_m)).norm(),
            1e-9);
  EXPECT_LT(
      (end({{0, 0}, 0.0, 10.0, -quarter_rad_s}) - Eigen::Vector2d(radius_m, -radius_m)).norm(),
      1e-9);
  EXPECT_LT((end({{0, 0}, 0.0, -10.0, 0.0}) - Eigen::Vector2d(-10.0, 0.0)).norm(), 1e-9);
}

TEST_F(PredictedPathTest, OneTurnSaysAll) {
  const PlanarMotion motion{{5.0, 5.0}, 1.0, 10.0, 0.5};
  const double turn_s = 2.0 * std::numbers::pi / 0.5;
  const Path once_m = *PredictedPath(motion, turn_s);
  const Path often_m = *PredictedPath(motion, 50.5 * turn_s);
  EXPECT_LT((often_m.back() - motion.position_m).norm(), 1e-6);
  ASSERT_EQ(often_m.size(), once_m.size());
  for (std::size_t i = 0; i < once_m.size(); ++i) {
    EXPECT_LT((once_m[i] - often_m[i]).norm(), 1e-6);
  }
}

TEST_F(PredictedPathTest, ItHasOneToAsManyPointsAsARouteMayHave) {
  EXPECT_EQ(PredictedPath({}, 10.0)->size(), 1U);
  EXPECT_EQ(PredictedPath({{3, 4}, 1.0, 0.0, 0.5}, 10.0)->size(), 1U);
  EXPECT_EQ(PredictedPath({{3, 4}, 1.0, 9.0, 0.5}, 0.0)->size(), 1U);
  for (const double horizon_s : {81.6, 82.0, 1e4, 1e9}) {
    const Path path_m = *PredictedPath({{0, 0}, 0.0, 20.0, 0.0}, horizon_s);
    EXPECT_EQ(path_m.size(), CorridorArea::kMaxRoutePoints);
    EXPECT_NEAR(path_m.back().x(), 20.0 * horizon_s, 1e-3);
  }
}

TEST_F(PredictedPathTest, WhatMakesNoSenseIsRefused) {
  const auto refusal = [](const PlanarMotion& motion, double horizon_s, double spacing_m = 1.0) {
    const auto path_m = PredictedPath(motion, horizon_s, spacing_m);
    return path_m ? StatusCode::kOk : path_m.error().code();
  };
  const PlanarMotion good{{0, 0}, 0.0, 1.0, 0.1};
  EXPECT_EQ(refusal(good, 1.0), StatusCode::kOk);
  for (const double bad : {kNan, kInfinity, -kInfinity}) {
    EXPECT_EQ(refusal({{bad, 0}, 0.0, 1.0, 0.1}, 1.0), StatusCode::kInvalidArgument);
    EXPECT_EQ(refusal({{0, bad}, 0.0, 1.0, 0.1}, 1.0), StatusCode::kInvalidArgument);
    EXPECT_EQ(refusal({{0, 0}, bad, 1.0, 0.1}, 1.0), StatusCode::kInvalidArgument);
    EXPECT_EQ(refusal({{0, 0}, 0.0, bad, 0.1}, 1.0), StatusCode::kInvalidArgument);
    EXPECT_EQ(refusal({{0, 0}, 0.0, 1.0, bad}, 1.0), StatusCode::kInvalidArgument);
    EXPECT_EQ(refusal(good, bad), StatusCode::kInvalidArgument);
  }
  EXPECT_EQ(refusal(good, -1.0), StatusCode::kInvalidArgument);
  for (const double spacing_m : {0.0, -1.0, kNan}) {
    EXPECT_EQ(refusal(good, 1.0, spacing_m), StatusCode::kInvalidArgument);
  }
}

}  // namespace
}  // namespace atlas
