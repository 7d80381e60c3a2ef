// Vehicles on known courses, seen well, badly or not at all.
#include "core/localization/odometry/motion_model.h"

#include <array>
#include <cmath>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "tests/core/localization/painted_map.h"

namespace atlas {
namespace {

using testing::ErrorOf;
using testing::UprightPose;

const Eigen::Matrix4d kSeenWell = Eigen::Vector4d(1e4, 1e4, 1e4, 1e6).asDiagonal();
const Eigen::Matrix4d kUnseen = Eigen::Matrix4d::Zero();
// Walls on both sides: y, z and the heading are seen, x is not.
const Eigen::Matrix4d kCorridor = Eigen::Vector4d(0.0, 1e4, 1e4, 1e6).asDiagonal();

Pose Straight(double x_m) {
  return UprightPose({x_m, 0.0, 1.8}, 0.0);
}

// On a circle of 20 m, 1 m a scan.
Pose OnCircle(int i) {
  const double angle = i / 20.0;
  return UprightPose({20.0 * std::sin(angle), 20.0 * (1.0 - std::cos(angle)), 1.8}, angle);
}

void ExpectIsCovariance(const PoseCovariance& covariance) {
  EXPECT_LT((covariance - covariance.transpose()).norm(), 1e-9 * covariance.norm());
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<PoseCovariance>(covariance).eigenvalues()(0), 0.0);
}

TEST(MotionModelTest, TheMotionDuringAScanIsThatToTheNext) {
  MotionModel model({});
  model.Start(OnCircle(0));
  EXPECT_TRUE(model.T_now_later().isApprox(Pose::Identity())) << "nothing is known yet";
  for (int i = 1; i <= 30; ++i) {
    model.Predict();
    model.Correct(OnCircle(i), kSeenWell);
  }
  const Pose right = OnCircle(30).inverse() * OnCircle(31);
  const Pose told = model.T_now_later();
  EXPECT_LT((told.translation() - right.translation()).norm(), 0.01);
  EXPECT_LT(Eigen::AngleAxisd(told.linear().transpose() * right.linear()).angle(), 0.002);
  // A sensor that is tilted on its vehicle moves the same way in the world.
  const Eigen::Matrix3d tilt = Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY()).toRotationMatrix();
  Pose tilted = OnCircle(30);
  tilted.linear() *= tilt;
  model.SetTilt(tilted.linear());
  const Pose next = tilted * model.T_now_later();
  EXPECT_LT(Eigen::AngleAxisd(next.linear().transpose() * (OnCircle(31).linear() * tilt)).angle(),
            0.002);
}

TEST(MotionModelTest, ASteadyMotionGoesOn) {
  MotionModel model({});
  model.Start(OnCircle(0));
  for (int i = 1; i <= 30; ++i) {
    model.Predict();
    if (i > 5) {
      EXPECT_LT(ErrorOf(model.T_world_sensor(), OnCircle(i)).horizontal_m, 0.01) << i;
      EXPECT_LT(ErrorOf(model.T_world_sensor(), OnCircle(i)).angle_rad, 0.002) << i;
      EXPECT_LT(SpreadOf(model.covariance()).along_m, 0.2);
    }
    model.Correct(OnCircle(i), kSeenWell);
    ExpectIsCovariance(model.covariance());
  }
}

// Every third scan arrives, or two in a row.
TEST(MotionModelTest, WhatIsMissingIsNoAcceleration) {
  MotionModel model({});
  model.Start(OnCircle(0));
  int at = 0;
  for (int i = 1; i <= 30; ++i) {
    const int scans = i > 5 && i % 3 == 0 ? 3 : 1;
    at += scans;
    model.Predict(scans);
    if (i > 5) {
      EXPECT_LT(ErrorOf(model.T_world_sensor(), OnCircle(at)).horizontal_m, 0.03 * scans) << i;
      EXPECT_LT(ErrorOf(model.T_world_sensor(), OnCircle(at)).angle_rad, 0.004 * scans) << i;
    }
    model.Correct(OnCircle(at), kSeenWell);
    ExpectIsCovariance(model.covariance());
  }
  model.Predict(4.0);
  EXPECT_GT(SpreadOf(model.covariance()).along_m, 0.3) << "it may have braked meanwhile";
  model.Turn(OnCircle(at + 4), kSeenWell);
  const Pose next = OnCircle(at + 4) * model.T_now_later();
  EXPECT_LT(ErrorOf(next, OnCircle(at + 5)).horizontal_m, 0.05) << "a scan's, not four's";
}

TEST(MotionModelTest, UnseenItStandsAndMayBeFarAhead) {
  MotionModel model({});
  model.Start(Straight(0.0));
  for (int i = 1; i <= 20; ++i) {
    model.Predict();
    model.Correct(Straight(0.0), kUnseen);
    ExpectIsCovariance(model.covariance());
  }
  const HorizontalSpread spread = SpreadOf(model.covariance());
  EXPECT_NEAR(spread.along_m, 20 * MotionOptions().ahead_m, 5.0);
  EXPECT_LT(spread.beside_m, 0.2 * spread.along_m);
  EXPECT_GT(std::abs(spread.direction.x()), 0.99);
}

TEST(MotionModelTest, APlaceFoundAfterManyScansTellsTheSpeedOfAllOfThem) {
  MotionModel model({});
  model.Start(Straight(0.0));
  for (int i = 1; i < 16; ++i) {
    model.Predict();
    model.Correct(model.T_world_sensor(), kUnseen);
  }
  model.Predict();
  model.Correct(Straight(2.5 * 16), kSeenWell);
  model.Predict();
  EXPECT_LT(ErrorOf(model.T_world_sensor(), Straight(2.5 * 17)).horizontal_m, 0.2);
}

// Its own scans tell each step, no map where it is. The sum of hundreds of uncertain steps is as
// uncertain as it has to be, and stays a covariance.
TEST(MotionModelTest, CarriedAlongItsPlaceBecomesSlowlyLessCertain) {
  constexpr double kStep_m = 0.02;
  const PoseCovariance step =
      Eigen::Vector4d(kStep_m, kStep_m, 0.015, 0.0015).cwiseAbs2().asDiagonal();
  MotionModel model({});
  model.Start(OnCircle(0));
  for (int i = 1; i <= 5; ++i) {
    model.Predict();
    model.Correct(OnCircle(i), kSeenWell);
  }
  double before_m = 0.0;
  for (int i = 6; i <= 400; ++i) {
    model.Predict();
    model.Carry(OnCircle(i), step);
    ExpectIsCovariance(model.covariance());
    ASSERT_LT(ErrorOf(model.T_world_sensor(), OnCircle(i)).horizontal_m, 0.2) << i;
    if (i == 105) before_m = SpreadOf(model.covariance()).along_m;
  }
  EXPECT_GT(before_m, 10 * kStep_m) << "a hundred steps";
  EXPECT_GT(SpreadOf(model.covariance()).along_m, before_m);
  EXPECT_NEAR(std::sqrt(model.covariance()(2, 2)), 0.015 * std::sqrt(395.0), 0.1);
}

// Where a step says nothing along the way, the vehicle goes on as it did.
TEST(MotionModelTest, AStepThatSaysNothingIsThatOfItsMotion) {
  MotionModel model({});
  model.Start(Straight(0.0));
  for (int i = 1; i <= 5; ++i) {
    model.Predict();
    model.Correct(Straight(1.5 * i), kSeenWell);
  }
  const PoseCovariance blind = Eigen::Vector4d(1e4, 1e-4, 1e-4, 1e-6).asDiagonal();
  for (int i = 6; i <= 15; ++i) {
    model.Predict();
    model.Carry(Straight(1.5 * i - 40.0), blind);
  }
  EXPECT_LT(ErrorOf(model.T_world_sensor(), Straight(1.5 * 15)).horizontal_m, 0.2);
  EXPECT_GT(SpreadOf(model.covariance()).along_m, 0.5);
}

TEST(MotionModelTest, ADirectionThatIsNoLongerSeenKeepsItsSpeed) {
  MotionModel model({});
  model.Start(Straight(0.0));
  for (int i = 1; i <= 5; ++i) {
    model.Predict();
    model.Correct(Straight(1.5 * i), kSeenWell);
  }
  for (int i = 6; i <= 25; ++i) {
    model.Predict();
    EXPECT_LT(ErrorOf(model.T_world_sensor(), Straight(1.5 * i)).horizontal_m, 0.3) << i;
    model.Correct(model.T_world_sensor(), kCorridor);
  }
  const HorizontalSpread spread = SpreadOf(model.covariance());
  EXPECT_GT(spread.along_m, 1.0);
  EXPECT_LT(spread.beside_m, 0.05);
}

TEST(MotionModelTest, AnHourOfScansWearsNothingOut) {
  MotionModel model({});
  model.Start(OnCircle(0));
  const std::array<Eigen::Matrix4d, 3> seen{kSeenWell, kCorridor, kUnseen};
  for (int i = 1; i <= 36000; ++i) {
    model.Predict();
    // Ten minutes of each in turn.
    model.Correct(model.T_world_sensor(), seen[static_cast<std::size_t>(i / 6000 % 3)]);
  }
  ExpectIsCovariance(model.covariance());
  EXPECT_TRUE(model.T_world_sensor().matrix().allFinite());
  model.Predict();
  model.Correct(OnCircle(0), kSeenWell);
  ExpectIsCovariance(model.covariance());
  EXPECT_LT(SpreadOf(model.covariance()).along_m, 0.02);
}

TEST(MotionModelTest, ATurnIsTakenUpAtOnce) {
  MotionModel model({});
  model.Start(Straight(0.0));
  for (int i = 1; i <= 5; ++i) {
    model.Predict();
    model.Correct(Straight(1.8 * i), kSeenWell);
  }
  const double step_rad = 0.8;
  Pose truth = Straight(9.0);
  for (int i = 0; i < 2; ++i) {
    model.Predict();
    const double heading = 0.5 * step_rad + i * step_rad;
    truth.translation() += 1.8 * Eigen::Vector3d(std::cos(heading), std::sin(heading), 0.0);
    truth.linear() =
        Eigen::AngleAxisd((i + 1) * step_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    if (i == 0) {
      model.Turn(truth, kSeenWell);
    }
  }
  EXPECT_LT(ErrorOf(model.T_world_sensor(), truth).horizontal_m, 0.05);
  EXPECT_LT(ErrorOf(model.T_world_sensor(), truth).angle_rad, 0.01);
}

TEST(MotionModelTest, RelocatedItsMotionIsForgotten) {
  MotionModel model({});
  model.Start(Straight(0.0));
  for (int i = 1; i <= 5; ++i) {
    model.Predict();
    model.Correct(Straight(1.5 * i), kSeenWell);
  }
  model.Relocate(Straight(50.0), kSeenWell);
  model.Predict();
  EXPECT_LT(ErrorOf(model.T_world_sensor(), Straight(50.0)).horizontal_m, 1e-9);
  EXPECT_NEAR(SpreadOf(model.covariance()).along_m, MotionOptions().ahead_m, 0.1);
}

TEST(PosePriorTest, DensityFallsWithTheSquareOfTheDistanceInSigmas) {
  const Eigen::Vector4d variances(4.0, 0.25, 1.0, 0.01);
  const PosePrior prior{Straight(3.0), variances.asDiagonal()};
  EXPECT_DOUBLE_EQ(LogDensity(prior, Straight(3.0)), 0.0);
  EXPECT_NEAR(LogDensity(prior, Straight(7.0)), -2.0, 1e-9);
  EXPECT_NEAR(LogDensity(prior, UprightPose({3.0, 1.0, 1.8}, 0.1)), -2.5, 1e-9);
}

}  // namespace
}  // namespace atlas
