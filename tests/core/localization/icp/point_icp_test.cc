#include "core/localization/icp/point_icp.h"

#include <numbers>

#include <gtest/gtest.h>

#include "core/base/hash_random.h"

namespace atlas {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

// Far enough from each other that none is mistaken for its neighbour.
std::vector<Eigen::Vector3f> Posts() {
  HashRandom random(3);
  std::vector<Eigen::Vector3f> points;
  for (int x = -6; x <= 6; ++x) {
    for (int y = -6; y <= 6; ++y) {
      points.emplace_back(2.0 * x + random.Uniform(-0.4, 0.4), 2.0 * y + random.Uniform(-0.4, 0.4),
                          random.Uniform(-1, 1));
    }
  }
  return points;
}

Pose At(const Eigen::Vector3d& place, const Eigen::Vector3d& axis, double angle_rad) {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::AngleAxisd(angle_rad, axis.normalized()).toRotationMatrix();
  pose.translation() = place;
  return pose;
}

std::vector<Eigen::Vector3f> SeenFrom(const Pose& T_map_scan,
                                      const std::vector<Eigen::Vector3f>& points) {
  std::vector<Eigen::Vector3f> seen;
  for (const Eigen::Vector3f& p : points) {
    seen.push_back((T_map_scan.inverse() * p.cast<double>()).cast<float>());
  }
  return seen;
}

TEST(PointIcpTest, FindsPlaceAndAttitude) {
  const PointIndex map(Posts());
  const Pose truth = At({0.3, -0.25, 0.1}, {0.2, -0.1, 1.0}, 2.0 * kDegree);
  const PointIcpResult result =
      AlignPoints(map, SeenFrom(truth, Posts()), Pose::Identity(), PointIcpOptions());
  EXPECT_TRUE(result.is_converged);
  EXPECT_EQ(result.pairs, Posts().size());
  EXPECT_LT((result.T_map_scan.translation() - truth.translation()).norm(), 1e-4);
  EXPECT_LT(Eigen::Quaterniond(result.T_map_scan.linear())
                .angularDistance(Eigen::Quaterniond(truth.linear())),
            1e-5);
  EXPECT_LT(result.rmse_m, 1e-3);
}

TEST(PointIcpTest, WhatIsBeyondTheReachDoesNotPull) {
  const PointIndex map(Posts());
  std::vector<Eigen::Vector3f> scan = Posts();
  for (int i = 0; i < 40; ++i) {
    scan.emplace_back(20.0F, 0.2F * static_cast<float>(i), 8.0F);
  }
  const PointIcpResult result =
      AlignPoints(map, scan, At({0.2, 0.0, 0.0}, {0, 0, 1}, 0.0), PointIcpOptions());
  EXPECT_EQ(result.pairs, Posts().size());
  EXPECT_LT(result.T_map_scan.translation().norm(), 1e-4);
}

TEST(PointIcpTest, TooFewPairsLeaveThePoseAsItIs) {
  const PointIndex map(Posts());
  const Pose start = At({0.2, 0.0, 0.0}, {0, 0, 1}, 0.0);
  std::vector<Eigen::Vector3f> few = Posts();
  few.resize(PointIcpOptions().min_pairs - 1);
  for (const auto& scan : {few, std::vector<Eigen::Vector3f>()}) {
    const PointIcpResult result = AlignPoints(map, scan, start, PointIcpOptions());
    EXPECT_FALSE(result.is_converged);
    EXPECT_TRUE(result.T_map_scan.isApprox(start));
  }
  EXPECT_EQ(AlignPoints(PointIndex({}), Posts(), start, PointIcpOptions()).pairs, 0U);
}

TEST(PointIcpTest, StopsAfterItsIterations) {
  const PointIndex map(Posts());
  PointIcpOptions options;
  options.max_iterations = 1;
  const PointIcpResult result = AlignPoints(
      map, SeenFrom(At({0.5, 0.3, 0}, {0, 0, 1}, 0.1), Posts()), Pose::Identity(), options);
  EXPECT_EQ(result.iterations, 1);
  EXPECT_FALSE(result.is_converged);
}

}  // namespace
}  // namespace atlas
