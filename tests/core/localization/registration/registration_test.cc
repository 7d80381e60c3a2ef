// Scans fitted into maps of the same small worlds.
#include "core/localization/registration/registration.h"

#include <cmath>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "tests/core/localization/painted_map.h"

namespace atlas {
namespace {

using testing::CastLeveledScan;
using testing::ErrorOf;
using testing::GarageMap;
using testing::kDegree;
using testing::PaintedMap;
using testing::PoseError;
using testing::ShapeWorld;
using testing::StreetMap;
using testing::UprightPose;

struct Offset {
  double x_m;
  double y_m;
  double yaw_deg;
};

// All corners of +-0.4 m and +-1.5 degrees, and some starts between.
std::vector<Offset> Starts() {
  std::vector<Offset> starts{{0.0, 0.0, 0.0}, {0.25, -0.1, 0.8}, {-0.4, 0.0, 0.0}, {0.0, 0.4, 0.0}};
  for (int corner = 0; corner < 8; ++corner) {
    starts.push_back({(corner & 1) != 0 ? 0.4 : -0.4, (corner & 2) != 0 ? 0.4 : -0.4,
                      (corner & 4) != 0 ? 1.5 : -1.5});
  }
  return starts;
}

Pose Displaced(const Pose& pose, const Offset& offset, double z_m = 0.0) {
  Pose displaced = pose;
  displaced.translation() += Eigen::Vector3d(offset.x_m, offset.y_m, z_m);
  displaced.linear() =
      Eigen::AngleAxisd(offset.yaw_deg * kDegree, Eigen::Vector3d::UnitZ()).toRotationMatrix() *
      pose.linear();
  return displaced;
}

ScanFeatures FeaturesAt(const ShapeWorld& world, const Pose& T_world_level) {
  return ExtractFeatures(CastLeveledScan(testing::QuickSensor(), world, T_world_level),
                         testing::QuickOptions().features);
}

void ExpectConverges(const PaintedMap& map, const ShapeWorld& world, const Pose& truth) {
  const MapWindow window = map.Window(truth.translation(), 30.0);
  const ScanFeatures features = FeaturesAt(world, truth);
  for (const Offset& offset : Starts()) {
    for (const double z_m : {-0.15, 0.2}) {
      const RegistrationResult result =
          Register(window, features, Displaced(truth, offset, z_m), {});
      const PoseError error = ErrorOf(result.T_world_level, truth);
      EXPECT_TRUE(result.is_converged);
      EXPECT_LT(error.horizontal_m, 0.05) << offset.x_m << " " << offset.y_m;
      EXPECT_LT(error.vertical_m, 0.03);
      EXPECT_LT(error.angle_rad, 0.25 * kDegree);
      EXPECT_GT(result.fit, 0.4);
    }
  }
}

// Standard deviations of the horizontal position, the better held direction first, and the worse
// one's direction.
Eigen::Vector2d HorizontalSigmas(const RegistrationResult& result,
                                 Eigen::Vector2d* worse = nullptr) {
  const Eigen::Matrix2d horizontal = result.information.topLeftCorner<2, 2>();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(horizontal);
  if (worse != nullptr) {
    *worse = solver.eigenvectors().col(0);
  }
  return solver.eigenvalues().reverse().cwiseMax(1e-12).cwiseSqrt().cwiseInverse();
}

TEST(RegistrationTest, ConvergesInAStreet) {
  ExpectConverges(StreetMap(), testing::Street(), UprightPose({0.3, 0.2, 1.8}, 0.0));
  ExpectConverges(StreetMap(), testing::Street(), UprightPose({-12.0, -2.5, 1.7}, 2.4));
}

TEST(RegistrationTest, ConvergesInAGarageCorner) {
  ExpectConverges(GarageMap(), testing::GarageCorner(), UprightPose({-6.0, -5.0, 1.8}, 0.7));
}

TEST(RegistrationTest, StaysOnTheDeckItStartsOn) {
  for (const double floor_m : {0.0, 3.0}) {
    ExpectConverges(GarageMap(), testing::GarageCorner(),
                    UprightPose({-5.0, -4.0, floor_m + 1.8}, -0.4));
  }
}

TEST(RegistrationTest, AStreetHoldsAllDirections) {
  const Pose truth = UprightPose({0.3, 0.2, 1.8}, 0.0);
  const RegistrationResult result = Register(StreetMap().Window(truth.translation(), 30.0),
                                             FeaturesAt(testing::Street(), truth), truth, {});
  EXPECT_LT(HorizontalSigmas(result).maxCoeff(), 0.05);
  EXPECT_GT(result.column_inliers, 0.8);
  EXPECT_GT(result.ground_inliers, 0.8);
}

TEST(RegistrationTest, ACorridorHoldsNothingAlongItself) {
  PaintedMap map;
  map.Paint(testing::Corridor(), 30.0);
  const Pose truth = UprightPose({0.3, 0.4, 1.8}, 0.3);
  const MapWindow window = map.Window(truth.translation(), 29.0);
  const ScanFeatures features = FeaturesAt(testing::Corridor(), truth);
  for (const double ahead_m : {-0.4, 0.0, 0.4}) {
    const RegistrationResult result =
        Register(window, features, Displaced(truth, {ahead_m, 0.3, 1.0}), {});
    Eigen::Vector2d worse;
    const Eigen::Vector2d sigmas = HorizontalSigmas(result, &worse);
    EXPECT_LT(sigmas.x(), 0.02);
    EXPECT_GT(sigmas.y(), 0.1);
    EXPECT_GT(std::abs(worse.x()), 0.99);
    // Across it all is known; along it the start is all there is.
    EXPECT_NEAR(result.T_world_level.translation().y(), 0.4, 0.03);
    EXPECT_NEAR(result.T_world_level.translation().x(), 0.3 + ahead_m, 0.1);
    EXPECT_LT(ErrorOf(result.T_world_level, truth).angle_rad, 0.2 * kDegree);
  }
}

TEST(RegistrationTest, APlainHoldsTheHeightAlone) {
  const ShapeWorld world{{testing::Patch{}}, {}};
  PaintedMap map;
  map.Paint(world, 30.0);
  const Pose truth = UprightPose({0.0, 0.0, 1.8}, 0.0);
  const Pose start = Displaced(truth, {0.3, -0.2, 1.0}, 0.2);
  const RegistrationResult result =
      Register(map.Window(truth.translation(), 29.0), FeaturesAt(world, truth), start, {});
  EXPECT_GT(HorizontalSigmas(result).minCoeff(), 1.0);
  EXPECT_NEAR(result.T_world_level.translation().z(), 1.8, 0.02);
  EXPECT_LT((result.T_world_level.translation() - start.translation()).head<2>().norm(), 1e-3);
  EXPECT_GT(result.ground_inliers, 0.6);  // rings reach beyond the map
}

TEST(RegistrationTest, ASlopeHoldsItsOwnDirection) {
  const ShapeWorld world{{testing::Patch{0.0, {0.15, 0.0}}}, {}};
  PaintedMap map;
  map.Paint(world, 30.0);
  const Pose truth = UprightPose({0.0, 0.0, 1.8}, 0.0);
  const RegistrationResult result =
      Register(map.Window(truth.translation(), 29.0), FeaturesAt(world, truth), truth, {});
  EXPECT_GT(result.information(0, 0), 100.0 * result.information(1, 1));
}

// What stands far ahead alone holds the heading only together with the place.
TEST(RegistrationTest, TheWorstSigmaCountsTheHeadingsError) {
  RegistrationResult result;
  const auto add_point = [&](const Eigen::Vector2d& p) {
    Eigen::Matrix<double, 2, 6> J = Eigen::Matrix<double, 2, 6>::Zero();
    J(0, 0) = J(1, 1) = 1.0;
    J(0, 5) = -p.y();
    J(1, 5) = p.x();
    result.information += 100.0 * J.transpose() * J;
  };
  EXPECT_GE(WorstSigma(result), 1e8);
  add_point({60.0, -3.0});
  add_point({60.0, 3.0});
  // Two points 0.1 m off each: 0.1 / sqrt(2) across if the heading were known; its own error, 0.1 /
  // (3 sqrt(2)) rad, counts 60 m away.
  EXPECT_NEAR(WorstSigma(result), 60.0 * 0.1 / (3.0 * std::sqrt(2.0)), 0.05);
  add_point({-60.0, 0.0});
  add_point({-60.0, 0.0});
  EXPECT_NEAR(WorstSigma(result), 0.05, 0.001);
}

TEST(RegistrationTest, WithoutAMapTheStartStays) {
  const Pose truth = UprightPose({0.3, 0.2, 1.8}, 0.5);
  const MapWindow empty = testing::Window(MapProfile(), {}, truth.translation(), 30.0);
  for (const ScanFeatures& features : {FeaturesAt(testing::Street(), truth), ScanFeatures()}) {
    const RegistrationResult result = Register(empty, features, truth, {});
    EXPECT_TRUE(result.is_converged);
    EXPECT_EQ(result.fit, 0.0);
    EXPECT_EQ(result.matched_columns, 0);
    EXPECT_LT(ErrorOf(result.T_world_level, truth).horizontal_m, 1e-9);
    EXPECT_LT(ErrorOf(result.T_world_level, truth).angle_rad, 1e-9);
    EXPECT_TRUE(result.information.isZero());
  }
}

TEST(RegistrationTest, WhereNothingHoldsItATiltedStartIsPutUpright) {
  const MapWindow empty = testing::Window(MapProfile(), {}, Eigen::Vector3d::Zero(), 10.0);
  for (const Eigen::Vector3d& axis : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(-0.6, 0.8, 0)}) {
    Pose start = UprightPose({0.0, 0.0, 0.0}, 0.0);
    start.linear() = Eigen::AngleAxisd(2.0 * kDegree, axis).toRotationMatrix();
    const RegistrationResult result = Register(empty, ScanFeatures(), start, {});
    EXPECT_GT(result.T_world_level.linear()(2, 2), std::cos(0.01 * kDegree));
  }
}

TEST(RegistrationTest, AnEmptyScanFitsNoMap) {
  const Pose start = UprightPose({0.3, 0.2, 1.8}, 0.5);
  const RegistrationResult result =
      Register(StreetMap().Window(start.translation(), 30.0), ScanFeatures(), start, {});
  EXPECT_EQ(result.fit, 0.0);
  EXPECT_TRUE(result.T_world_level.matrix().allFinite());
}

TEST(RegistrationTest, TheTiltIsTheImusWithinItsError) {
  // The levelled frame is off by half a degree; far ground and walls say so, the prior holds some.
  const Pose truth = UprightPose({0.3, 0.2, 1.8}, 0.0);
  Pose start = truth;
  start.linear() = Eigen::AngleAxisd(0.5 * kDegree, Eigen::Vector3d::UnitY()).toRotationMatrix();
  const RegistrationResult result = Register(StreetMap().Window(truth.translation(), 30.0),
                                             FeaturesAt(testing::Street(), truth), start, {});
  EXPECT_LT(ErrorOf(result.T_world_level, truth).angle_rad, 0.15 * kDegree);
}

TEST(RegistrationTest, InformationIsSymmetricAndNeverNegative) {
  for (const double yaw : {0.0, 0.8, 2.0}) {
    const Pose truth = UprightPose({-3.0, 1.0, 1.77}, yaw);
    const RegistrationResult result = Register(StreetMap().Window(truth.translation(), 30.0),
                                               FeaturesAt(testing::Street(), truth), truth, {});
    EXPECT_TRUE(result.information.isApprox(result.information.transpose()));
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> solver(result.information);
    EXPECT_GT(solver.eigenvalues().minCoeff(), 0.0);
    EXPECT_GE(result.fit, 0.0);
    EXPECT_LE(result.fit, 1.0);
  }
}

TEST(RegistrationTest, IsTheSameEveryTime) {
  const Pose truth = UprightPose({0.3, 0.2, 1.8}, 0.4);
  const Pose start = Displaced(truth, {0.3, -0.3, 1.0});
  const auto run = [&] {
    return Register(StreetMap().Window(truth.translation(), 30.0),
                    FeaturesAt(testing::Street(), truth), start, {});
  };
  const RegistrationResult first = run();
  const RegistrationResult second = run();
  EXPECT_EQ(first.T_world_level.matrix(), second.T_world_level.matrix());
  EXPECT_EQ(first.information, second.information);
  EXPECT_EQ(first.fit, second.fit);
}

// A thin wall was mapped from the south; who stands north of it sees its other face 0.6 m further.
TEST(RegistrationTest, TheFarFaceOfAWallIsNotTakenForTheMappedOne) {
  ShapeWorld world;
  world.patches = {testing::Patch{}};
  world.boxes = {testing::Box{{-20.0, 0.05, -1.0}, {20.0, 0.65, 4.0}}};
  PaintedMap map;
  for (int x = -200; x < 200; ++x) {
    for (int y = -100; y < 0; ++y) {
      TileLayer free = testing::GroundLayer(0.0);
      free.column = 0x1111;
      map.Put(x, y, free);
    }
    map.Put(x, 0, testing::ColumnLayer(0.0, 0b1111));
  }
  for (const double y_m : {-4.0, 4.65}) {
    const Pose truth = UprightPose({0.0, y_m, 1.8}, 0.0);
    const RegistrationResult result =
        Register(map.Window(truth.translation(), 30.0), FeaturesAt(world, truth), truth, {});
    EXPECT_LT(std::abs(result.T_world_level.translation().y() - y_m), 0.06) << y_m;
    EXPECT_EQ(result.matched_columns > 0, y_m < 0.0) << y_m;
  }
}

TEST(RegistrationTest, EvidenceIsHighestWhereTheScanWasTaken) {
  const Pose truth = UprightPose({-3.0, 0.5, 1.77}, 0.0);
  const MapWindow window = StreetMap().Window(truth.translation(), 30.0);
  const ScanFeatures features = FeaturesAt(testing::Street(), truth);
  const RegistrationResult right = Register(window, features, truth, {});
  EXPECT_GT(right.evidence, 0.3 * static_cast<double>(features.columns.size()));
  EXPECT_GT(right.column_fit, 0.5);
  for (const Offset& offset :
       {Offset{6.0, 0.0, 0.0}, Offset{-9.0, 0.0, 0.0}, Offset{0.0, 0.0, 100.0}}) {
    const RegistrationResult wrong = Register(window, features, Displaced(truth, offset), {});
    EXPECT_LT(wrong.evidence, 0.5 * right.evidence) << offset.x_m << " " << offset.yaw_deg;
    EXPECT_LT(wrong.column_fit, right.column_fit);
  }
}

TEST(RegistrationTest, TheScanAndThePriorMeetByTheirInformation) {
  // Along a corridor nothing holds the vehicle but its prior; across it the walls do.
  PaintedMap map;
  map.Paint(testing::Corridor(), 30.0);
  const Pose truth = UprightPose({0.0, 0.0, 1.8}, 0.0);
  const Pose expected = Displaced(truth, {0.5, 0.3, 0.0});
  const Eigen::Vector4d variances(0.01, 0.01, 0.01, 1e-4);
  const RegistrationResult result =
      Register(map.Window(truth.translation(), 30.0), FeaturesAt(testing::Corridor(), truth), truth,
               {expected, variances.asDiagonal()}, {});
  EXPECT_NEAR(result.T_world_level.translation().x(), 0.5, 0.02);
  EXPECT_NEAR(result.T_world_level.translation().y(), 0.0, 0.03);
}

}  // namespace
}  // namespace atlas
