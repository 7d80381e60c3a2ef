// Keyframes go where their submaps go, without a step between two of them.
#include "client/merge/plan/pose_correction.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/client/merge/plan/blind_session.h"

namespace atlas {
namespace {

using testing::AngleBetween;
using testing::At;
using testing::BlindSession;
using testing::DistanceBetween;
using testing::Straight;

std::vector<Pose> SubmapsOf(const MergeSession& session) {
  std::vector<Pose> poses;
  for (const MergeSubmap& submap : session.submaps) {
    poses.push_back(StoredPose(session, submap));
  }
  return poses;
}

void ExpectNear(const std::vector<Pose>& is, const std::vector<Pose>& should, double within) {
  ASSERT_EQ(is.size(), should.size());
  for (std::size_t i = 0; i < is.size(); ++i) {
    EXPECT_LT(DistanceBetween(is[i], should[i]), within) << i;
    EXPECT_LT(AngleBetween(is[i], should[i]), within) << i;
  }
}

std::vector<Pose> Bend() {
  std::vector<Pose> poses;
  for (int i = 0; i < 60; ++i) {
    const double angle_rad = 0.02 * i;
    poses.push_back(
        At(50.0 * std::sin(angle_rad), 50.0 * (1.0 - std::cos(angle_rad)), 0.05 * i, angle_rad));
  }
  return poses;
}

TEST(PoseCorrectionTest, WhereNothingMovesNothingDoes) {
  const MergeSession session = BlindSession("car", Bend());
  ASSERT_EQ(session.submaps.size(), 6U);
  ExpectNear(CorrectedPoses(session, SubmapsOf(session)), StoredPoses(session), 1e-7);
}

TEST(PoseCorrectionTest, OfNoKeyframesThereAreNone) {
  EXPECT_TRUE(CorrectedPoses(MergeSession(), {}).empty());
}

TEST(PoseCorrectionTest, AMotionOfAllMovesAll) {
  const MergeSession session = BlindSession("car", Bend());
  for (const Pose& motion :
       {At(40.0, -7.0, 2.0), At(0.0, 0.0, 0.0, 2.5), At(3.0, 4.0, 5.0, -1.0)}) {
    std::vector<Pose> submaps = SubmapsOf(session);
    for (Pose& pose : submaps) pose = motion * pose;
    std::vector<Pose> should = StoredPoses(session);
    for (Pose& pose : should) pose = motion * pose;
    // Between two submaps a line is drawn where the way bends: as far off as that is long.
    ExpectNear(CorrectedPoses(session, submaps), should, 1e-7);
  }
}

// Each submap moved by what its middle has drifted: each keyframe by what it has.
TEST(PoseCorrectionTest, DriftBetweenSubmapsIsSharedOutAlongTheWay) {
  const MergeSession session = BlindSession("car", Straight(At(0.0), 61));
  ASSERT_EQ(session.submaps.size(), 6U);
  std::vector<Pose> submaps = SubmapsOf(session);
  for (Pose& pose : submaps) {
    pose.translation().y() += 0.01 * pose.translation().x();
    pose.translation().z() -= 0.02 * pose.translation().x();
  }
  const std::vector<Pose> corrected = CorrectedPoses(session, submaps);
  for (std::size_t i = 0; i < corrected.size(); ++i) {
    const auto at_m = static_cast<double>(i);
    EXPECT_LT(DistanceBetween(corrected[i], At(at_m, 0.01 * at_m, -0.02 * at_m)), 1e-6) << i;
  }
}

// A drift that grows along the way, as one does that wanders: of a line between two middles it
// would be off by 25 mm.
TEST(PoseCorrectionTest, DriftThatBendsIsFollowed) {
  const MergeSession session = BlindSession("car", Straight(At(0.0), 61));
  std::vector<Pose> submaps = SubmapsOf(session);
  const auto drift_m = [](double at_m) {
    return 0.002 * (at_m - 20.0) * (at_m - 20.0);
  };
  for (Pose& pose : submaps) pose.translation().y() += drift_m(pose.translation().x());
  const std::vector<Pose> corrected = CorrectedPoses(session, submaps);
  for (std::size_t i = session.submaps.front().middle(); i <= session.submaps.back().middle();
       ++i) {
    const auto at_m = static_cast<double>(i);
    EXPECT_LT(DistanceBetween(corrected[i], At(at_m, drift_m(at_m))), 1e-6) << i;
  }
}

// Two submaps of a vehicle that crept stand half a metre apart, and do not agree: what that would
// come to in ten metres is no drift.
TEST(PoseCorrectionTest, WhoCreepsThrowsNobodyOffTheRoad) {
  std::vector<Pose> poses = Straight(At(0.0), 40, 0.02);
  const std::vector<Pose> drive = Straight(At(0.8), 40);
  poses.insert(poses.end(), drive.begin(), drive.end());
  const MergeSession session = BlindSession("car", poses);
  ASSERT_GE(session.submaps.size(), 4U);
  std::vector<Pose> submaps = SubmapsOf(session);
  submaps[0] = At(0.0, 0.05) * submaps[0];
  const std::vector<Pose> corrected = CorrectedPoses(session, submaps);
  for (std::size_t i = 0; i < corrected.size(); ++i) {
    EXPECT_LT(std::abs(corrected[i].translation().y()), 0.08) << i;
  }
}

TEST(PoseCorrectionTest, TurnsAreSharedOutToo) {
  const MergeSession session = BlindSession("car", Straight(At(0.0), 20));
  ASSERT_EQ(session.submaps.size(), 2U);
  std::vector<Pose> submaps = SubmapsOf(session);
  submaps[1].rotate(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ()));
  const std::vector<Pose> corrected = CorrectedPoses(session, submaps);
  const std::size_t first = session.submaps[0].middle();
  const std::size_t last = session.submaps[1].middle();
  for (std::size_t i = 0; i < corrected.size(); ++i) {
    const auto along = static_cast<double>(i) - static_cast<double>(first);
    const double yaw_rad = 0.1 * along / static_cast<double>(last - first);
    EXPECT_LT(AngleBetween(corrected[i], At(0.0, 0.0, 0.0, yaw_rad)), 1e-7) << i;
  }
}

TEST(PoseCorrectionTest, ThereIsNoStepWhereOneSubmapEndsAndTheNextBegins) {
  const MergeSession session = BlindSession("car", Straight(At(0.0), 121, 0.5));
  ASSERT_EQ(session.submaps.size(), 6U);  // of 10 m
  std::vector<Pose> submaps = SubmapsOf(session);
  for (std::size_t i = 0; i < submaps.size(); ++i) {
    const double sign = i % 2 == 0 ? 1.0 : -1.0;
    submaps[i] = At(0.1 * sign, 0.3 * sign, 0.2 * sign) * submaps[i];
    submaps[i].rotate(Eigen::AngleAxisd(0.001 * sign, Eigen::Vector3d::UnitZ()));
  }
  const std::vector<Pose> stored = StoredPoses(session);
  const std::vector<Pose> corrected = CorrectedPoses(session, submaps);
  for (std::size_t i = 1; i < corrected.size(); ++i) {
    const Pose before = stored[i - 1].inverse() * corrected[i - 1];
    const Pose now = stored[i].inverse() * corrected[i];
    // 0.75 m and 0.002 rad in all on the 10 m from one to the next, half a metre of them here; a
    // curve is up to twice as steep as a line.
    EXPECT_LT(DistanceBetween(now, before), 2.0 * 0.05 * 0.8) << i;
    EXPECT_LT(AngleBetween(now, before), 2.0 * 0.05 * 0.0022) << i;
  }
}

// Whatever is behind a jump says nothing of what is before it.
TEST(PoseCorrectionTest, AJumpIsAnEnd) {
  std::vector<Pose> poses = Straight(At(0.0), 20);
  const std::vector<Pose> behind = Straight(At(200.0), 20);
  poses.insert(poses.end(), behind.begin(), behind.end());
  const MergeSession session = BlindSession("car", poses);
  ASSERT_EQ(session.submaps.size(), 4U);
  ASSERT_TRUE(session.submaps[2].cut.follows_jump);
  std::vector<Pose> submaps = SubmapsOf(session);
  for (const std::size_t i : {2U, 3U}) submaps[i] = At(0.0, 6.0) * submaps[i];
  const std::vector<Pose> corrected = CorrectedPoses(session, submaps);
  for (std::size_t i = 0; i < corrected.size(); ++i) {
    EXPECT_NEAR(corrected[i].translation().y(), i < 20 ? 0.0 : 6.0, 1e-7) << i;
  }
}

TEST(PoseCorrectionTest, AVehicleThatStandsMovesWithTheSubmapItIsIn) {
  const MergeSession session = BlindSession("car", Straight(At(5.0), 60, 0.0));
  ASSERT_EQ(session.submaps.size(), 3U);
  std::vector<Pose> submaps = SubmapsOf(session);
  submaps[1] = At(0.0, 1.0) * submaps[1];
  const std::vector<Pose> corrected = CorrectedPoses(session, submaps);
  for (std::size_t i = 0; i < corrected.size(); ++i) {
    const SubmapCut& cut = session.submaps[1].cut;
    const bool is_moved = i >= cut.begin && i < cut.end;
    EXPECT_NEAR(corrected[i].translation().y(), is_moved ? 1.0 : 0.0, 1e-7) << i;
  }
}

// Poses are told from those by which submaps were fused, not from what is stored.
TEST(PoseCorrectionTest, GoesOnFromPosesThatWereCorrectedBefore) {
  MergeSession session = BlindSession("car", Straight(At(0.0), 30));
  std::vector<Pose> better = StoredPoses(session);
  for (std::size_t i = 0; i < better.size(); ++i) {
    better[i].translation().y() += 0.01 * static_cast<double>(i * i) / 30.0;
  }
  session.T_world_sensor = better;
  std::vector<Pose> submaps;
  for (MergeSubmap& submap : session.submaps) {
    submap.T_world_submap = better[submap.middle()];
    submaps.push_back(At(0.0, 0.0, 1.0) * submap.T_world_submap);
  }
  for (Pose& pose : better) pose = At(0.0, 0.0, 1.0) * pose;
  ExpectNear(CorrectedPoses(session, submaps), better, 1e-9);
}

}  // namespace
}  // namespace atlas
