// The presence of returns in occupied segments, and its derivatives.
#include "core/localization/registration/presence.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/core/localization/painted_map.h"

namespace atlas {
namespace {

using testing::ColumnLayer;
using testing::ErrorOf;
using testing::kDegree;
using testing::PaintedMap;
using testing::StreetMap;
using testing::UprightPose;

TEST(CellKernelTest, AllCellsTogetherHoldThePointAndItsDerivativesAreThoseOfItsShares) {
  const CellKernel kernel(0.4F);
  constexpr float kStep = 1.0F / 128.0F;  // of the table
  for (float offset = 0.1F; offset < 0.9F; offset += 0.05F) {
    EXPECT_NEAR(kernel.At(offset)[7].value, 1.0, 0.004);
    EXPECT_EQ(kernel.At(offset)[0].value, 0.0F);
    for (std::size_t cells = 1; cells < 8; ++cells) {
      const auto& before = kernel.At(offset - 3.0F * kStep)[cells];
      const auto& at = kernel.At(offset)[cells];
      const auto& behind = kernel.At(offset + 3.0F * kStep)[cells];
      EXPECT_NEAR(at.slope, (behind.value - before.value) / (6.0F * kStep), 0.02) << cells;
      EXPECT_NEAR(at.curve, (behind.slope - before.slope) / (6.0F * kStep), 0.08) << cells;
    }
  }
}

TEST(PresenceTest, IsOneWithinAWallHalfAtItsFaceAndNoneBesideIt) {
  PaintedMap map;
  for (int x = -20; x <= 20; ++x) {
    for (int y = 0; y < 6; ++y) map.Put(x, y, ColumnLayer(0.0, 0b1));
  }
  const MapWindow window = map.Window(Eigen::Vector3d::Zero(), 5.0);
  const CellKernel kernel(0.4F);
  const auto at = [&](double y_m, double z_m = 0.5) {
    return window.PresenceAt((Eigen::Vector3d(0.0, y_m, z_m) - window.origin()).cast<float>(),
                             kernel);
  };
  EXPECT_NEAR(at(0.35).value, 1.0, 0.01);
  EXPECT_LT(at(0.35).gradient.norm(), 1.0F) << "per metre; 10 at its face";
  EXPECT_NEAR(at(0.0).value, 0.5, 0.02);
  EXPECT_NEAR(at(0.0).gradient.y(), 0.4 / 0.04, 0.2) << "of a Gaussian of 0.04 m";
  EXPECT_LT(at(0.6).gradient.y(), 0.0F);
  EXPECT_NEAR(at(-0.2).value, 0.0, 1e-3);
  EXPECT_EQ(at(0.3, 1.5).value, 0.0F) << "above it";
  EXPECT_EQ(at(400.0).value, 0.0F);
}

// The sum's gradient against differences, in all six directions.
TEST(PresenceTest, TheGradientIsThatOfTheSum) {
  const Pose truth = UprightPose({2.0, 0.4, 1.82}, 0.3);
  const MapWindow window = StreetMap().Window(truth.translation(), 28.0);
  const ScanFeatures scan = ExtractFeatures(
      CastLeveledScan(testing::QuickSensor(), testing::Street(), truth), {.max_range_m = 25.0F});
  ASSERT_GT(scan.returns.size(), 1'000U);
  Pose pose = truth;
  pose.translation() += Eigen::Vector3d(0.06, -0.05, 0.0);
  const PresenceSum sum = SumPresence(window, scan.returns, pose);
  EXPECT_LT(sum.log_likelihood, SumPresence(window, scan.returns, truth).log_likelihood);
  for (const int axis : {0, 1, 5}) {  // a tilt moves returns between segments: no derivative there
    const auto sum_at = [&](double distance) {
      NormalEquations::Vector6 step = NormalEquations::Vector6::Zero();
      step(axis) = distance;
      return SumPresence(window, scan.returns, Moved(pose, step)).log_likelihood;
    };
    constexpr int kSteps = 8;  // a return's share changes in small steps: one may be unlucky
    double slope = 0.0;
    for (int k = 1; k <= kSteps; ++k) {
      const double distance = k * (axis < 3 ? 5e-3 : 4e-4);
      slope += (sum_at(distance) - sum_at(-distance)) / (2.0 * distance * kSteps);
    }
    EXPECT_NEAR(-sum.equations.g(axis), slope, 0.05 * std::abs(slope) + 30.0) << axis;
  }
}

TEST(PresenceTest, ReturnsNobodyMappedSayNothing) {
  const MapWindow window = StreetMap().Window(Eigen::Vector3d(0.0, 0.0, 1.8), 20.0);
  const std::vector<Eigen::Vector3f> returns(50, Eigen::Vector3f(1.0F, 0.0F, 0.0F));
  const PresenceSum sum = SumPresence(window, returns, UprightPose({0.0, 0.0, 1.8}, 0.0));
  EXPECT_EQ(sum.log_likelihood, 0.0);
  EXPECT_EQ(sum.equations.g.norm(), 0.0);
  EXPECT_EQ(SumPresence(window, {}, UprightPose({0.0, 0.0, 1.8}, 0.0)).log_likelihood, 0.0);
}

}  // namespace
}  // namespace atlas
