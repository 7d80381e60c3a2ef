// What a submap is of its keyframes: the same wherever their session lies, upright at the middle
// one's sensor, each turned by another angle.
#include "core/alignment/submap.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include <gtest/gtest.h>

#include "core/alignment/submap_match.h"
#include "core/keyframe/grid_attitude.h"
#include "tests/core/support/keyframe_worlds.h"
#include "tests/core/support/simulated_keyframes.h"

namespace atlas {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

Pose Upright(const Eigen::Vector3d& at, double yaw_rad) {
  Pose pose = Pose::Identity();
  pose.translation() = at;
  pose.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return pose;
}

std::vector<SubmapMember> Members(const testing::DrivenKeyframes& driven,
                                  const Pose& T_new_world = Pose::Identity()) {
  std::vector<SubmapMember> members;
  for (std::size_t i = 0; i < driven.keyframes.size(); ++i) {
    const auto sequence = static_cast<std::uint32_t>(i);
    members.push_back({{{"car", "drive"}, sequence},
                       100 * static_cast<std::int64_t>(sequence),
                       T_new_world * driven.T_world_sensor[i],
                       driven.keyframes[i]});
  }
  return members;
}

// Nothing seen, but a vehicle that was there, `step_m` a keyframe along x.
std::vector<SubmapMember> Blind(std::size_t count, double step_m, const MapProfile& profile) {
  testing::DrivenKeyframes driven;
  for (std::size_t i = 0; i < count; ++i) {
    driven.T_world_sensor.push_back(Upright({step_m * static_cast<double>(i), 0.0, 1.73}, 0.0));
    driven.keyframes.push_back(
        std::make_shared<const Keyframe>(testing::BlankKeyframe(profile, 10)));
  }
  return Members(driven);
}

class SubmapTest : public ::testing::Test {
 protected:
  Submap Fuse(const std::vector<SubmapMember>& members, std::uint64_t number) const {
    return Submap::Fuse(members, number, profile_, {}).value();
  }

  MapProfile profile_;
};

TEST_F(SubmapTest, StandsUprightAtTheMiddleSensorAndIsTurnedByItsNumber) {
  std::vector<SubmapMember> members = Blind(5, 1.0, profile_);
  for (SubmapMember& member : members) {
    member.T_world_sensor = member.T_world_sensor * Upright({0.0, 0.0, 0.0}, 0.8);
    member.T_world_sensor.rotate(Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitY()));
  }
  for (const std::uint64_t number : {0U, 1U, 77U}) {
    const Pose frame = SubmapFrame(members, number);
    EXPECT_TRUE(frame.translation().isApprox(members[2].T_world_sensor.translation(), 1e-12));
    EXPECT_NEAR(frame.linear()(2, 2), 1.0, 1e-12);
    const double yaw_rad = SplitYaw(Eigen::Quaterniond(frame.linear())).yaw_rad;
    EXPECT_NEAR(std::remainder(yaw_rad - 0.8 - GridYaw(number), 2.0 * std::numbers::pi), 0.0, 1e-3);
  }
  EXPECT_TRUE(SubmapFrame(std::span(members).first(2), 0)
                  .translation()
                  .isApprox(members[1].T_world_sensor.translation(), 1e-12));
}

TEST_F(SubmapTest, ReachesAsFarAsItsKeyframesSee) {
  EXPECT_NEAR(Fuse(Blind(1, 0.0, profile_), 3).radius_m(), 1.0, 1e-9);
  EXPECT_NEAR(Fuse(Blind(5, 1.5, profile_), 3).radius_m(), 3.0 + 1.0, 1e-6);
  EXPECT_NEAR(Fuse(Blind(4, 1.5, profile_), 3).radius_m(), 3.0 + 1.0, 1e-6);  // from the third
}

TEST_F(SubmapTest, PlacesAreBelowTheSensorAlongTheWay) {
  const std::vector<SubmapMember> members = Blind(7, 0.75, profile_);
  const Submap submap = Fuse(members, 9);
  const Pose T_submap_world = SubmapFrame(members, 9).inverse();
  ASSERT_EQ(submap.places().size(), 3U);  // the first, and wherever 2 m have been driven
  for (const std::size_t i : {0U, 1U, 2U}) {
    const Eigen::Vector3d at =
        T_submap_world * Eigen::Vector3d(2.25 * static_cast<double>(i), 0, 0);
    EXPECT_LT((submap.places()[i].ground - at).norm(), 1e-9) << i;
  }
}

TEST_F(SubmapTest, OfWhatSawNothingIsEmpty) {
  const Submap submap = Fuse(Blind(3, 1.0, profile_), 1);
  EXPECT_TRUE(submap.features().columns.empty());
  EXPECT_TRUE(submap.features().ground.empty());
  EXPECT_TRUE(submap.DecodeTiles(profile_)->empty());
}

TEST_F(SubmapTest, IsMadeOfMeasuredGroundAndOfColumns) {
  Keyframe keyframe = testing::BlankKeyframe(profile_, 40);
  KeyframeCell road;
  road.source = AltitudeSource::kMeasured;
  road.occupancy = Occupancy::kFree;
  road.altitude_mm = -1'730;
  testing::FillDisc(keyframe, road);
  KeyframeCell wall = road;
  wall.occupancy = Occupancy::kObstacle;
  wall.altitude_mm = -1'300;
  for (std::int32_t iy = -20; iy < 20; ++iy) {
    const std::size_t index = keyframe.grid.Index(25, iy);
    keyframe.cells[index] = wall;
    keyframe.columns[index] = 0xFFF0;  // from the second segment on
  }
  std::fill(keyframe.anchors.begin(), keyframe.anchors.end(), std::int16_t{-2});
  const std::vector<SubmapMember> members{{{{"car", "drive"}, 4},
                                           400,
                                           Upright({100.0, 50.0, 8.0}, 0.3),
                                           std::make_shared<const Keyframe>(keyframe)}};
  const Submap submap = Fuse(members, 12);
  const Pose T_sensor_submap = members[0].T_world_sensor.inverse() * SubmapFrame(members, 12);
  ASSERT_GT(submap.features().ground.size(), 20U);
  ASSERT_GT(submap.features().columns.size(), 10U);
  for (const Eigen::Vector3f& p : submap.features().ground) {
    EXPECT_NEAR((T_sensor_submap * p.cast<double>()).z(), -1.73, 0.002);
    EXPECT_LT(p.norm(), 4.7);
  }
  for (const Eigen::Vector3f& p : submap.features().columns) {
    const Eigen::Vector3d seen = T_sensor_submap * p.cast<double>();
    EXPECT_NEAR(seen.x(), 2.55, 0.11);
    EXPECT_LT(std::abs(seen.y()), 2.2);
    EXPECT_GT(seen.z(), -1.1);
    EXPECT_LT(seen.z(), 2.1);
  }
}

// A square of ground alone: cells are where their middles are.
TEST_F(SubmapTest, GroundLiesWhereItsCellsDo) {
  Keyframe keyframe = testing::BlankKeyframe(profile_, 40);
  for (std::int32_t iy = -25; iy < -15; ++iy) {
    for (std::int32_t ix = 10; ix < 20; ++ix) {
      keyframe.cells[keyframe.grid.Index(ix, iy)] = {-1'730, Occupancy::kFree,
                                                     AltitudeSource::kMeasured};
    }
  }
  const std::vector<SubmapMember> members{
      {{{"car", "drive"}, 4}, 400, Pose::Identity(), std::make_shared<const Keyframe>(keyframe)}};
  SubmapOptions options;
  options.features.ground_voxel_m = 0.1F;  // each cell by itself
  const Submap submap = Submap::Fuse(members, 3, profile_, options).value();
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (const Eigen::Vector3f& p : submap.features().ground) sum += p;
  const Eigen::Vector3f middle = sum / static_cast<float>(submap.features().ground.size());
  const Eigen::Vector3d seen = SubmapFrame(members, 3) * middle.cast<double>();
  EXPECT_NEAR(static_cast<double>(submap.features().ground.size()), 100.0, 8.0);
  EXPECT_LT((seen - Eigen::Vector3d(1.5, -2.0, -1.73)).norm(), 0.02);
}

TEST_F(SubmapTest, APoseTiltedAgainstItsGridIsInvalidAndNamed) {
  for (const double tilt_deg : {1.9, 2.1, -2.1}) {
    std::vector<SubmapMember> members = Blind(4, 1.0, profile_);
    members[2].T_world_sensor.rotate(
        Eigen::AngleAxisd(tilt_deg * kDegree, Eigen::Vector3d::UnitX()));
    const auto submap = Submap::Fuse(members, 1, profile_, {});
    ASSERT_EQ(submap.has_value(), std::abs(tilt_deg) < 2.0) << tilt_deg;
    if (submap) continue;
    EXPECT_EQ(submap.error().code(), StatusCode::kInvalidData);
    EXPECT_NE(submap.error().message().find("car/drive/2"), std::string::npos)
        << submap.error().message();
  }
}

TEST_F(SubmapTest, TilesAreOfTheProfileTheyWereMadeFor) {
  testing::DrivenKeyframes driven;
  driven.T_world_sensor = {Pose::Identity()};
  driven.keyframes = {std::make_shared<const Keyframe>(testing::StreetKeyframe(profile_, 60, 5))};
  const Submap submap = Fuse(Members(driven), 1);
  MapProfile other = profile_;
  other.hit_units = 26;
  const auto tiles = submap.DecodeTiles(other);
  ASSERT_FALSE(tiles.has_value());
  EXPECT_EQ(tiles.error().code(), StatusCode::kInvalidData);
}

// On a piece of a street.
class StreetSubmapTest : public SubmapTest {
 protected:
  testing::DrivenKeyframes driven_ = testing::DriveThrough({.first = 40, .count = 8}, profile_);
};

TEST_F(StreetSubmapTest, IsTheSameWhereverTheSessionLies) {
  const Submap here = Fuse(Members(driven_), 5);
  const auto tiles = here.DecodeTiles(profile_);
  ASSERT_TRUE(tiles.has_value());
  ASSERT_GT(tiles->size(), 8U);
  for (const Pose& moved :
       {Upright({1234.5, -777.25, 31.0}, 0.0), Upright({-3.0, 8.0, 0.0}, 2.5)}) {
    const Submap there = Fuse(Members(driven_, moved), 5);
    const auto others = there.DecodeTiles(profile_);
    ASSERT_TRUE(others.has_value());
    ASSERT_EQ(others->size(), tiles->size());
    for (std::size_t i = 0; i < tiles->size(); ++i) {
      EXPECT_TRUE(*(*others)[i] == *(*tiles)[i]) << i;
    }
    EXPECT_EQ(there.features().columns, here.features().columns);
    EXPECT_EQ(there.features().ground, here.features().ground);
  }
}

TEST_F(StreetSubmapTest, FeaturesLieWhereTheStreetIs) {
  const std::vector<SubmapMember> members = Members(driven_);
  const Submap submap = Fuse(members, 5);
  ASSERT_EQ(submap.places().size(), 4U);
  EXPECT_GT(submap.features().columns.size(), 300U);
  EXPECT_GT(submap.features().ground.size(), 300U);
  double height_m = 0.0;
  int near = 0;
  for (const Eigen::Vector3f& p : submap.features().ground) {
    EXPECT_LT(p.head<2>().norm(), submap.radius_m());
    if (p.head<2>().norm() > 3.0) continue;
    height_m += p.z();
    ++near;
  }
  ASSERT_GT(near, 5);
  EXPECT_NEAR(height_m / near, -1.8, 0.05);
  for (const Eigen::Vector3f& p : submap.features().columns) {
    EXPECT_GT(p.z(), -1.8);
  }
}

// As the same keyframes were fused, turned by other angles.
TEST_F(StreetSubmapTest, TwoTurnsOfOneFitToMillimetres) {
  const std::vector<SubmapMember> members = Members(driven_);
  const Submap one = Fuse(members, 5);
  const Submap other = Fuse(members, 6);
  const MatchOptions options;
  const auto a = SubmapWindow::Make(one, profile_, options);
  const auto b = SubmapWindow::Make(other, profile_, options);
  ASSERT_TRUE(a.has_value() && b.has_value());
  const Pose T_a_b = SubmapFrame(members, 5).inverse() * SubmapFrame(members, 6);
  EXPECT_GT(std::abs(SplitYaw(Eigen::Quaterniond(T_a_b.linear())).yaw_rad), 0.1);
  const SubmapMatch match = MatchSubmaps(*a, *b, Upright({0.1, -0.1, 0.03}, 0.01) * T_a_b, options);
  EXPECT_TRUE(IsBelieved(match, options));
  const Pose off = T_a_b.inverse() * match.T_a_b;
  EXPECT_LT(off.translation().norm(), 0.005);
  EXPECT_LT(Eigen::AngleAxisd(off.linear()).angle(), 0.03 * kDegree);
}

// Right beside the one keyframe ground that was only drawn between two returns, 0.1 m too high; the
// other one measured it from 8 m away.
TEST_F(SubmapTest, GroundThatWasMeasuredCountsMoreThanWhatWasInterpolatedNearby) {
  std::vector<SubmapMember> members;
  for (const auto& [x_m, first_cell, altitude_mm, source] :
       {std::tuple{0.0, 15, std::int16_t{-1'630}, AltitudeSource::kInterpolated},
        std::tuple{10.0, -85, std::int16_t{-1'730}, AltitudeSource::kMeasured}}) {
    Keyframe keyframe = testing::BlankKeyframe(profile_, 100);
    for (std::int32_t x = first_cell; x < first_cell + 10; ++x) {
      for (std::int32_t y = -5; y < 5; ++y) {
        keyframe.cells[keyframe.grid.Index(x, y)] = {altitude_mm, Occupancy::kFree, source};
      }
    }
    members.push_back({{{"car", "drive"}, static_cast<std::uint32_t>(members.size())},
                       100,
                       Upright({x_m, 0.0, 1.73}, 0.0),
                       std::make_shared<const Keyframe>(std::move(keyframe))});
  }
  const Pose frame = SubmapFrame(members, 3);
  const Submap submap = Fuse(members, 3);
  const std::vector<Eigen::Vector3f>& ground = submap.features().ground;
  int seen = 0;
  for (const Eigen::Vector3f& p : ground) {
    const Eigen::Vector3d p_world = frame * p.cast<double>();
    if (std::abs(p_world.x() - 2.0) > 0.4) continue;
    EXPECT_NEAR(p_world.z(), 0.0, 0.01) << p_world.transpose();
    ++seen;
  }
  EXPECT_GT(seen, 0);
}

}  // namespace
}  // namespace atlas
