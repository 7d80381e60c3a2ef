// A session that would have to be tilted too far against how its grids were levelled: left where it
// is, with why, and no matter to the others.
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "client/merge/plan/merge_planner.h"
#include "core/base/hash.h"
#include "core/keyframe/keyframe_codec.h"
#include "tests/client/merge/plan/blind_session.h"
#include "tests/core/support/keyframe_worlds.h"

namespace atlas {
namespace {

using testing::At;
using testing::BlindSession;
using testing::FoundAsStored;
using testing::Staged;
using testing::Straight;

Bytes BlobTiltedBy(double tilt_rad) {
  Keyframe keyframe = testing::BlankKeyframe(MapProfile(), 4);
  const double one = 1 << QuantizedPose::kQuaternionBits;
  keyframe.level_quaternion = {static_cast<std::int32_t>(std::lround(one * std::cos(tilt_rad / 2))),
                               static_cast<std::int32_t>(std::lround(one * std::sin(tilt_rad / 2))),
                               0, 0};
  return EncodeKeyframe(keyframe);
}

MergeSession LevelSession(const std::string& name, double x_m, std::size_t keyframes) {
  MergeSession session = BlindSession(name, Straight(At(x_m), keyframes));
  for (MergeKeyframe& keyframe : session.keyframes) keyframe.blob_hash = Hash64(BlobTiltedBy(0.0));
  return Staged(std::move(session));
}

// Blobs that are level the first time that they are read, and tilted by three degrees afterwards:
// as if what was found had tilted the session by as much.
BlobReader LevelOnce(std::size_t keyframes) {
  return [keyframes, read = std::make_shared<std::size_t>(0)](std::size_t) -> Result<Bytes> {
    return BlobTiltedBy((*read)++ < keyframes ? 0.0 : 3.0 * std::numbers::pi / 180.0);
  };
}
BlobReader Level() {
  return [](std::size_t) -> Result<Bytes> {
    return BlobTiltedBy(0.0);
  };
}

TEST(TiltedSessionTest, ItIsLeftOutWithWhyAndTouchesNothing) {
  for (const int refinements : {0, 2}) {
    MergeOptions options;
    options.refinements = refinements;
    std::vector<MergeSession> sessions{LevelSession("car", 0.0, 31)};
    const std::size_t keyframes = sessions[0].keyframes.size();
    MergeWork work = MergeWork::Temporary().value();
    const auto plan =
        PlanMerge(sessions, {LevelOnce(keyframes)}, {MapProfile(), options, work}, nullptr);
    ASSERT_TRUE(plan.has_value()) << plan.error().message();
    EXPECT_FALSE(plan->sessions[0].is_joined);
    EXPECT_TRUE(plan->sessions[0].is_refused);
    EXPECT_TRUE(plan->sessions[0].moved.empty());
    EXPECT_NE(plan->sessions[0].why_not.find("keyframe 0"), std::string::npos)
        << plan->sessions[0].why_not;
    EXPECT_TRUE(plan->tiles.empty());
  }
}

TEST(TiltedSessionTest, OthersAreMergedAsEver) {
  std::vector<MergeSession> sessions{LevelSession("level", 0.0, 41),
                                     LevelSession("tilted", 99.0, 31)};
  MergeWork work = MergeWork::Temporary().value();
  const auto plan =
      PlanMerge(sessions, {Level(), LevelOnce(31)}, {MapProfile(), MergeOptions(), work}, nullptr);
  ASSERT_TRUE(plan.has_value()) << plan.error().message();
  EXPECT_TRUE(plan->sessions[0].is_joined) << "the larger one becomes the map";
  EXPECT_FALSE(plan->sessions[1].is_joined);
  EXPECT_FALSE(plan->sessions[1].is_refused) << "it meets nobody, and is not moved";
  EXPECT_FALSE(plan->tiles.empty());
}

// Beside it, 0.5 m off as their closures have it: half of that the level one would move.
TEST(TiltedSessionTest, WhoMeetsItIsNotBentByIt) {
  std::vector<MergeSession> sessions{LevelSession("level", 0.0, 41),
                                     LevelSession("tilted", 0.0, 41),
                                     LevelSession("behind", 20.0, 31)};
  const MoreClosures meet = [&](const auto&, const auto&) {
    std::vector<FoundClosure> closures;
    for (const std::size_t i : {0U, 1U, 2U}) {
      closures.push_back(FoundAsStored(sessions, {0, i}, {1, i}, At(0.0, 0.5)));
      closures.push_back(FoundAsStored(sessions, {1, i}, {2, i}));
    }
    return closures;
  };
  MergeWork work = MergeWork::Temporary().value();
  const auto plan = PlanMerge(sessions, {Level(), LevelOnce(41), Level()},
                              {MapProfile(), MergeOptions(), work}, nullptr, meet);
  ASSERT_TRUE(plan.has_value()) << plan.error().message();
  EXPECT_TRUE(plan->sessions[0].is_joined);
  EXPECT_TRUE(plan->sessions[0].moved.empty());
  EXPECT_FALSE(plan->sessions[1].is_joined);
  EXPECT_NE(plan->sessions[1].why_not.find("keyframe 0 to 40: "), std::string::npos)
      << plan->sessions[1].why_not;
  EXPECT_NE(plan->sessions[1].why_not.find("3.00 degrees"), std::string::npos);
  EXPECT_FALSE(plan->sessions[2].is_joined) << "it hangs on the tilted one alone";
  EXPECT_TRUE(plan->closures.empty());
}

// Two closures are enough where the others have both there: without the others they are two.
TEST(TiltedSessionTest, WhoHungOnItDoesNotStayByTwoClosures) {
  std::vector<MergeSession> sessions{LevelSession("level", 0.0, 41),
                                     LevelSession("tilted", 0.0, 41),
                                     LevelSession("behind", 20.0, 31)};
  const MoreClosures meet = [&](const auto&, const auto&) {
    std::vector<FoundClosure> closures;
    for (const std::size_t i : {0U, 1U, 2U}) {
      closures.push_back(FoundAsStored(sessions, {0, i}, {1, i}));
      closures.push_back(FoundAsStored(sessions, {1, i}, {2, i}));
    }
    for (const std::size_t i : {0U, 1U}) {
      closures.push_back(FoundAsStored(sessions, {0, i}, {2, i}));
    }
    return closures;
  };
  MergeWork work = MergeWork::Temporary().value();
  const auto plan = PlanMerge(sessions, {Level(), LevelOnce(41), Level()},
                              {MapProfile(), MergeOptions(), work}, nullptr, meet);
  ASSERT_TRUE(plan.has_value()) << plan.error().message();
  EXPECT_TRUE(plan->sessions[1].is_refused);
  EXPECT_FALSE(plan->sessions[2].is_joined);
  EXPECT_TRUE(plan->closures.empty()) << "two, and nobody else has them there";
}

// What it contradicted, by more than the others have to say, is not lost when it goes.
TEST(TiltedSessionTest, WhatItContradictedIsLookedAtAgain) {
  std::vector<MergeSession> sessions{LevelSession("level", 0.0, 41),
                                     LevelSession("tilted", 0.0, 41),
                                     LevelSession("other", 0.0, 41)};
  sessions[0].is_staged = false;
  bool is_found = false;
  const MoreClosures meet = [&](const auto&, const auto&) {
    std::vector<FoundClosure> closures;
    for (const std::size_t i : {0U, 1U, 2U, 3U}) {
      if (is_found) break;
      closures.push_back(FoundAsStored(sessions, {0, i}, {1, i}));
      closures.push_back(FoundAsStored(sessions, {1, i}, {2, i}));
      const Pose T_world_a = StoredPose(sessions[0], sessions[0].submaps[i]);
      const Pose off = T_world_a.inverse() * At(0.0, 3.0) * T_world_a;
      if (i < 3) closures.push_back(FoundAsStored(sessions, {0, i}, {2, i}, off));
    }
    is_found = true;
    return closures;
  };
  MergeOptions options;
  options.refinements = 0;
  MergeWork work = MergeWork::Temporary().value();
  const auto plan = PlanMerge(sessions, {Level(), LevelOnce(41), Level()},
                              {MapProfile(), options, work}, nullptr, meet);
  ASSERT_TRUE(plan.has_value()) << plan.error().message();
  EXPECT_TRUE(plan->sessions[1].is_refused);
  EXPECT_TRUE(plan->sessions[2].is_joined) << plan->sessions[2].why_not;
  EXPECT_EQ(plan->closures.size(), 3U);
}

// All three by as much, of which one alone has a part in it: it is the last to go, and the others
// come back.
TEST(TiltedSessionTest, WhoWasTiltedByItIsNotBlamed) {
  std::vector<MergeSession> sessions{LevelSession("level", 0.0, 61),
                                     LevelSession("tilted", 0.0, 41),
                                     LevelSession("bent", 20.0, 31)};
  sessions[0].is_staged = false;
  // What lies 2.7 degrees off can only be reached where the one that is tilted is reached.
  const Pose roll(Eigen::AngleAxisd(2.7 * std::numbers::pi / 180.0, Eigen::Vector3d::UnitX()));
  const MoreClosures meet = [&](const auto&, const auto&) {
    std::vector<FoundClosure> closures;
    for (const std::size_t i : {0U, 1U, 2U}) {
      const Pose T_world_a = StoredPose(sessions[0], sessions[0].submaps[i]);
      const Pose off = T_world_a.inverse() * roll * T_world_a;
      closures.push_back(FoundAsStored(sessions, {0, i}, {1, i}, off));
      closures.push_back(FoundAsStored(sessions, {1, i}, {2, i}));
    }
    return closures;
  };
  MergeOptions options;
  options.graph.tilt_sigma_rad = 0.2;  // gravity does not hold them
  MergeWork work = MergeWork::Temporary().value();
  const auto plan = PlanMerge(sessions, {Level(), Level(), Level()}, {MapProfile(), options, work},
                              nullptr, meet);
  ASSERT_TRUE(plan.has_value()) << plan.error().message();
  EXPECT_TRUE(plan->sessions[0].is_joined);
  EXPECT_TRUE(plan->sessions[0].moved.empty());
  EXPECT_NE(plan->sessions[1].why_not.find("levelled otherwise"), std::string::npos)
      << plan->sessions[1].why_not;
  EXPECT_EQ(plan->sessions[2].why_not, "meets no session of the map often enough");
}

// The first to go, as it leans by itself and is bent on top of that, comes back, and so does what
// it has in common with who meets it at two places only.
TEST(TiltedSessionTest, WhoComesBackMeetsFewAgain) {
  std::vector<MergeSession> sessions{LevelSession("level", 0.0, 121),
                                     LevelSession("tilted", 0.0, 121),
                                     LevelSession("bent", 0.0, 121), LevelSession("few", 0.0, 121)};
  sessions[0].is_staged = false;
  const double leaning_rad = 1.6 * std::numbers::pi / 180.0;
  for (MergeKeyframe& one : sessions[2].keyframes)
    one.blob_hash = Hash64(BlobTiltedBy(leaning_rad));
  const BlobReader leaning = [&](std::size_t) -> Result<Bytes> {
    return BlobTiltedBy(leaning_rad);
  };
  const Pose roll(Eigen::AngleAxisd(-2.8 * std::numbers::pi / 180.0, Eigen::Vector3d::UnitX()));
  bool is_found = false;
  const MoreClosures meet = [&](const auto&, const auto&) {
    std::vector<FoundClosure> closures;
    if (std::exchange(is_found, true)) return closures;
    const auto add = [&](std::size_t a, std::size_t b, std::size_t count, const Pose& moved) {
      for (std::size_t i = 0; i < count; ++i) {
        const Pose T_world_a = StoredPose(sessions[a], sessions[a].submaps[i]);
        const Pose off = T_world_a.inverse() * moved * T_world_a;
        closures.push_back(FoundAsStored(sessions, {a, i}, {b, i}, off));
      }
    };
    add(0, 1, 10, roll);
    add(0, 2, 3, Pose::Identity());
    add(0, 3, 3, Pose::Identity());
    add(1, 2, 9, Pose::Identity());
    add(2, 3, 2, Pose::Identity());
    return closures;
  };
  MergeOptions options;
  options.graph.tilt_sigma_rad = 0.2;
  options.refinements = 0;
  MergeWork work = MergeWork::Temporary().value();
  const auto plan = PlanMerge(sessions, {Level(), Level(), leaning, Level()},
                              {MapProfile(), options, work}, nullptr, meet);
  ASSERT_TRUE(plan.has_value()) << plan.error().message();
  EXPECT_TRUE(plan->sessions[1].is_refused);
  EXPECT_TRUE(plan->sessions[2].is_joined) << plan->sessions[2].why_not;
  EXPECT_EQ(plan->closures.size(), 8U);
}

}  // namespace
}  // namespace atlas
