// Submaps of two drives through simulated worlds: found where they are, and not believed elsewhere.
#include "core/alignment/submap_match.h"

#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <vector>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "tests/core/support/simulated_keyframes.h"

namespace atlas {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

double AngleOf(const Pose& pose) {
  return Eigen::AngleAxisd(pose.linear()).angle();
}

Pose Off(double x_m, double y_m, double z_m, double yaw_rad) {
  Pose pose = Pose::Identity();
  pose.translation() = Eigen::Vector3d(x_m, y_m, z_m);
  pose.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return pose;
}

// A piece of a drive as a submap, and where it truly lies.
class PieceOfWorld {
 public:
  PieceOfWorld(const testing::DrivePiece& piece, std::uint64_t number) {
    const testing::DrivenKeyframes driven = testing::DriveThrough(piece, profile_);
    std::vector<SubmapMember> members;
    for (std::size_t i = 0; i < driven.keyframes.size(); ++i) {
      const auto sequence = static_cast<std::uint32_t>(piece.first + i);
      members.push_back({{{"car", "drive"}, sequence},
                         250 * static_cast<std::int64_t>(sequence),
                         driven.T_world_sensor[i],
                         driven.keyframes[i]});
    }
    T_world_submap_ = SubmapFrame(members, number);
    submap_ = std::make_unique<Submap>(Submap::Fuse(members, number, profile_, {}).value());
    window_ =
        std::make_unique<SubmapWindow>(SubmapWindow::Make(*submap_, profile_, options_).value());
  }

  Pose To(const PieceOfWorld& other) const {
    return T_world_submap_.inverse() * other.T_world_submap_;
  }
  SubmapMatch Match(const PieceOfWorld& other, const Pose& start) const {
    return MatchSubmaps(*window_, *other.window_, start, options_);
  }
  std::vector<Pose> Search(const PieceOfWorld& other,
                           const Pose& start,
                           const SearchReach& reach) const {
    return SearchSubmap(*window_, *other.submap_, start, reach, options_);
  }
  bool IsBelieved(const SubmapMatch& match) const { return atlas::IsBelieved(match, options_); }

 private:
  MapProfile profile_;
  MatchOptions options_;
  Pose T_world_submap_ = Pose::Identity();
  std::unique_ptr<Submap> submap_;
  std::unique_ptr<SubmapWindow> window_;
};

// Two drives along the same lane, their noise, traffic and lattices different.
class SubmapMatchTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    first_ =
        std::make_unique<PieceOfWorld>(testing::DrivePiece{.seed = 0, .first = 40, .count = 8}, 11);
    second_ =
        std::make_unique<PieceOfWorld>(testing::DrivePiece{.seed = 2, .first = 42, .count = 8}, 12);
  }
  static void TearDownTestSuite() {
    first_.reset();
    second_.reset();
  }

  inline static std::unique_ptr<PieceOfWorld> first_;
  inline static std::unique_ptr<PieceOfWorld> second_;
};

TEST_F(SubmapMatchTest, IsFoundFromNearby) {
  const Pose truth = first_->To(*second_);
  for (const Pose& off :
       {Off(0.3, 0.0, 0.0, kDegree), Off(-0.2, 0.2, 0.1, -kDegree), Off(0.0, -0.3, -0.1, 0.0)}) {
    const SubmapMatch match = first_->Match(*second_, truth * off);
    EXPECT_TRUE(first_->IsBelieved(match));
    const Pose error = truth.inverse() * match.T_a_b;
    EXPECT_LT(error.translation().norm(), 0.03);
    EXPECT_LT(AngleOf(error), 0.1 * kDegree);
    EXPECT_LT(match.apart_m, 0.03);
    EXPECT_GT(match.explained, 0.5);
  }
}

// From there to here is from here to there backwards, and as certain.
TEST_F(SubmapMatchTest, IsTheSameTheOtherWay) {
  const Pose start = first_->To(*second_) * Off(0.1, 0.1, 0.02, 0.005);
  const SubmapMatch there = first_->Match(*second_, start);
  const SubmapMatch back = second_->Match(*first_, start.inverse());
  const Pose round_trip = there.T_a_b * back.T_a_b;
  EXPECT_LT(round_trip.translation().norm(), 1e-3);
  ASSERT_GT(there.apart_rad, 1e-6);
  EXPECT_LT(AngleOf(round_trip), 0.1 * there.apart_rad);
  EXPECT_NEAR(there.fit, back.fit, 1e-9);
  EXPECT_NEAR(there.columns, back.columns, 1e-9);
  EXPECT_NEAR(there.explained, back.explained, 1e-9);
  EXPECT_NEAR(there.sigma_m, back.sigma_m, 1e-9);
  EXPECT_NEAR(there.apart_rad, back.apart_rad, 1e-6);
  // A step of b seen from a, and the step of a seen from b that leads to the same: as unlikely.
  for (int axis = 0; axis < 6; ++axis) {
    Eigen::Matrix<double, 6, 1> step = Eigen::Matrix<double, 6, 1>::Zero();
    step(axis) = 1e-5;
    Pose moved = there.T_a_b;
    moved.translation() += step.head<3>();
    if (axis >= 3) {
      moved.linear() =
          Eigen::AngleAxisd(step(axis), Eigen::Vector3d::Unit(axis - 3)) * moved.linear();
    }
    const Pose backwards = moved.inverse();
    const Pose before = there.T_a_b.inverse();
    const Eigen::AngleAxisd turn(Eigen::Matrix3d(backwards.linear() * before.linear().transpose()));
    Eigen::Matrix<double, 6, 1> other;
    other.head<3>() = backwards.translation() - before.translation();
    other.tail<3>() = turn.angle() * turn.axis();
    const double seen_here = step.dot(there.information * step);
    const double seen_there = other.dot(back.information * other);
    EXPECT_NEAR(seen_there / seen_here, 1.0, 0.02) << axis;
  }
}

TEST_F(SubmapMatchTest, InformationIsSymmetricAndOfBothWays) {
  const SubmapMatch match = first_->Match(*second_, first_->To(*second_));
  EXPECT_TRUE(match.information.isApprox(match.information.transpose(), 1e-9));
  const Eigen::SelfAdjointEigenSolver<Matrix6> solver(match.information);
  EXPECT_GT(solver.eigenvalues().minCoeff(), 0.0);
  EXPECT_LT(match.sigma_m, 0.02);
}

TEST_F(SubmapMatchTest, AnotherPlaceIsNotBelieved) {
  const PieceOfWorld elsewhere({.seed = 2, .first = 90, .count = 8}, 13);
  for (const double yaw_rad : {0.0, 0.5 * std::numbers::pi, std::numbers::pi}) {
    EXPECT_FALSE(first_->IsBelieved(first_->Match(elsewhere, Off(0.0, 0.0, 0.0, yaw_rad))));
  }
  const Pose as_if = first_->To(*second_);
  EXPECT_FALSE(first_->IsBelieved(first_->Match(elsewhere, as_if)));
}

TEST_F(SubmapMatchTest, ItsOwnPlaceIsNotBelievedFarOff) {
  const Pose truth = first_->To(*second_);
  for (const Pose& off :
       {Off(6.0, 0.0, 0.0, 0.0), Off(0.0, 0.0, 3.0, 0.0), Off(0.0, 0.0, 0.0, std::numbers::pi)}) {
    const SubmapMatch match = first_->Match(*second_, truth * off);
    const bool is_right = (truth.inverse() * match.T_a_b).translation().norm() < 0.05 &&
                          AngleOf(truth.inverse() * match.T_a_b) < 0.2 * kDegree;
    EXPECT_TRUE(is_right || !first_->IsBelieved(match));
  }
}

TEST_F(SubmapMatchTest, EachNumberHasItsLimit) {
  SubmapMatch match;
  match.fit = 0.6;
  match.columns = 0.3;
  match.sigma_m = 0.02;
  match.apart_m = 0.1;
  match.apart_rad = 0.5 * kDegree;
  EXPECT_TRUE(IsBelieved(match, {}));
  const auto is_believed_with = [&](auto change) {
    SubmapMatch other = match;
    change(other);
    return IsBelieved(other, {});
  };
  EXPECT_FALSE(is_believed_with([](SubmapMatch& other) { other.fit = 0.59; }));
  EXPECT_FALSE(is_believed_with([](SubmapMatch& other) { other.columns = 0.29; }));
  EXPECT_FALSE(is_believed_with([](SubmapMatch& other) { other.sigma_m = 0.021; }));
  EXPECT_FALSE(is_believed_with([](SubmapMatch& other) { other.apart_m = 0.11; }));
  EXPECT_FALSE(is_believed_with([](SubmapMatch& other) { other.apart_rad = 0.51 * kDegree; }));
  EXPECT_FALSE(is_believed_with(
      [](SubmapMatch& other) { other.fit = std::numeric_limits<double>::quiet_NaN(); }));
}

TEST_F(SubmapMatchTest, ASearchFindsItFromMetresOff) {
  const Pose truth = first_->To(*second_);
  const std::vector<Pose> starts = first_->Search(
      *second_, truth * Off(2.5, -1.5, 0.0, 4.0 * kDegree), {4.0, 4.0, 6.0 * kDegree});
  ASSERT_FALSE(starts.empty());
  ASSERT_LE(starts.size(), MatchOptions().search.candidates);
  const SubmapMatch match = first_->Match(*second_, starts.front());
  EXPECT_TRUE(first_->IsBelieved(match));
  EXPECT_LT((truth.inverse() * match.T_a_b).translation().norm(), 0.03);
}

// What each of two places alone has seen (the far side of a trunk, a road that rises to a kerb
// which a ring hit) pulls all matches along a drive the same way: a map of them would be too short,
// and bent.
TEST(StreetMatchTest, ARowOfSubmapsIsNeitherShortenedNorBent) {
  constexpr std::size_t kCount = 8;  // keyframes: 10 m
  std::vector<PieceOfWorld> row;
  for (std::size_t i = 0; i < 9; ++i) {
    row.emplace_back(testing::DrivePiece{.first = 20 + kCount * i, .count = kCount}, 30 + i);
  }
  double along_m = 0.0;
  double pitch_rad = 0.0;
  for (std::size_t i = 0; i + 1 < row.size(); ++i) {
    const Pose truth = row[i].To(row[i + 1]);
    const SubmapMatch match = row[i].Match(row[i + 1], truth);
    ASSERT_TRUE(row[i].IsBelieved(match)) << i;
    const Eigen::Vector3d ahead = truth.translation().normalized();
    const Eigen::Vector3d left = Eigen::Vector3d::UnitZ().cross(ahead).normalized();
    along_m += (match.T_a_b.translation() - truth.translation()).dot(ahead);
    const Eigen::AngleAxisd turn(
        Eigen::Matrix3d(match.T_a_b.linear() * truth.linear().transpose()));
    pitch_rad += turn.angle() * turn.axis().dot(left);
  }
  const double links = static_cast<double>(row.size() - 1);
  EXPECT_LT(std::abs(along_m / links), 2e-3);
  EXPECT_LT(std::abs(pitch_rad / links), 0.015 * kDegree);
}

// The next deck looks much the same, 3.2 m above.
TEST(GarageMatchTest, TheOtherDeckIsNotBelievedFromItsHeight) {
  const PieceOfWorld below({.world = WorldKind::kGarage, .first = 80, .count = 8}, 21);
  const PieceOfWorld again({.world = WorldKind::kGarage, .seed = 2, .first = 81, .count = 8}, 22);
  const PieceOfWorld above({.world = WorldKind::kGarage, .seed = 2, .first = 140, .count = 8}, 23);
  EXPECT_NEAR(below.To(above).translation().z(), 3.2, 0.01);
  EXPECT_TRUE(below.IsBelieved(below.Match(again, below.To(again) * Off(0.2, -0.1, 0.05, 0.01))));
  for (const double height_m : {0.0, 0.2, -0.2, -1.0}) {
    const Pose start = Off(0.0, 0.0, height_m, 0.0) * below.To(above);
    EXPECT_FALSE(below.IsBelieved(below.Match(above, start))) << height_m;
  }
}

}  // namespace
}  // namespace atlas
