// A merge from a source to corrections, and what is said of it.
#include "client/merge/merge_run.h"

#include <set>
#include <string>

#include <gtest/gtest.h>

#include "tests/client/merge/plan/blind_session.h"
#include "tests/client/merge/source/listed_sessions.h"

namespace atlas {
namespace {

using testing::At;
using testing::BlindSession;
using testing::ListedSessions;
using testing::Staged;
using testing::Straight;

// Of a session in the map that stays, one in the map that moves, a staged one that is published and
// one that stays staged.
MergeRun SomeRun() {
  MergeRun run;
  run.sessions = {BlindSession("held", Straight(At(0.0), 12)),
                  BlindSession("moved", Straight(At(0.0, 5.0), 12)),
                  Staged(BlindSession("published", Straight(At(0.0, 10.0), 12))),
                  Staged(BlindSession("apart", Straight(At(50.0), 12)))};
  run.plan.sessions.resize(4);
  for (const std::size_t i : {0U, 1U, 2U}) run.plan.sessions[i].is_joined = true;
  for (const std::size_t i : {1U, 2U}) {
    run.plan.sessions[i].moved = {{0, QuantizedPose::FromPose(At(0.0, 7.0))},
                                  {3, QuantizedPose::FromPose(At(3.0, 7.0))}};
  }
  run.sessions[1].keyframes[3].sequence = 33;
  run.revision = 42;
  return run;
}

TEST(MergeRunTest, CorrectionsNameEachKeyframeThatMoves) {
  const std::vector<PoseCorrection> corrections = SomeRun().Corrections();
  ASSERT_EQ(corrections.size(), 4U);
  EXPECT_EQ(corrections[1].key, (KeyframeKey{{"moved", "drive"}, 33}));
  EXPECT_EQ(corrections[1].T_world_sensor, QuantizedPose::FromPose(At(3.0, 7.0)));
  EXPECT_EQ(corrections[2].key, (KeyframeKey{{"published", "drive"}, 0}));
}

TEST(MergeRunTest, StagedSessionsThatAreJoinedArePublished) {
  MergeRun run = SomeRun();
  EXPECT_EQ(run.Published(), (std::vector<SessionKey>{{"published", "drive"}}));
  EXPECT_FALSE(run.IsNothing());
  for (SessionOutcome& outcome : run.plan.sessions) outcome.moved.clear();
  EXPECT_FALSE(run.IsNothing()) << "published where it is";
  run.plan.sessions[2].is_joined = false;
  EXPECT_TRUE(run.IsNothing());
}

TEST(MergeRunTest, WhoWasAskedForAndStaysOutIsToldWithWhy) {
  MergeRun run = SomeRun();
  run.plan.sessions[3].why_not = "meets nobody";
  run.left_out = {{{"gone", "drive"}, "retracted"},
                  {{"published", "drive"}, "keyframe 3: damaged"}};
  const std::vector<SessionKey> all{
      {"gone", "drive"}, {"published", "drive"}, {"held", "drive"}, {"apart", "drive"}};
  std::vector<UnmergedSession> unmerged = UnmergedOf(run, all);
  ASSERT_EQ(unmerged.size(), 2U);
  EXPECT_EQ(unmerged[0].key, all[0]);
  EXPECT_EQ(unmerged[0].why, "retracted");
  EXPECT_FALSE(unmerged[0].is_waiting);
  EXPECT_EQ(unmerged[1].key, all[3]);
  EXPECT_EQ(unmerged[1].why, "meets nobody");
  EXPECT_TRUE(unmerged[1].is_waiting);
  run.plan.sessions[3].is_refused = true;
  EXPECT_FALSE(UnmergedOf(run, all)[1].is_waiting) << "whoever comes, it is tilted";
  EXPECT_TRUE(UnmergedOf(run, {}).empty());
}

TEST(MergeRunTest, ThePictureHasWaysBeforeAndAfter) {
  MergeRun run = SomeRun();
  run.plan.closures.push_back(testing::Found({1, 0}, {2, 0}, At(0.0)));
  run.plan.tiles = {{0, -1, 2}};
  const MergePicture picture = run.Picture();
  ASSERT_EQ(picture.tiles.size(), 1U);
  EXPECT_NEAR(picture.tiles[0].min().x(), -12.8, 1e-9);
  EXPECT_NEAR(picture.tiles[0].max().y(), 38.4, 1e-9);
  ASSERT_EQ(picture.sessions.size(), 4U);
  EXPECT_EQ(picture.sessions[1].name, "moved/drive");
  EXPECT_EQ(picture.sessions[3].name, "apart/drive, stays as it is");
  EXPECT_EQ(picture.sessions[0].before, picture.sessions[0].after);
  ASSERT_EQ(picture.sessions[1].after.size(), 12U);
  EXPECT_EQ(picture.sessions[1].before[3], Eigen::Vector2d(3.0, 5.0));
  EXPECT_EQ(picture.sessions[1].after[3], Eigen::Vector2d(3.0, 7.0));
  EXPECT_EQ(picture.sessions[1].after[4], Eigen::Vector2d(4.0, 5.0));
  ASSERT_EQ(picture.closures_before.size(), 1U);
  ASSERT_EQ(picture.closures_after.size(), 1U);
  EXPECT_EQ(picture.closures_before[0].first.y(), 5.0);
  EXPECT_EQ(picture.closures_before[0].second.y(), 10.0);
}

TEST(MergeRunTest, WhatIsReadIsPlanned) {
  ListedSessions source;
  source.Add({"a", "day"}, "staged", 12);
  source.Add({"b", "day"}, "live", 12);
  source.Add({"c", "day"}, "retracted", 1);
  std::set<std::string> steps;
  const auto run = RunMerge(source, {}, {}, testing::SharedWork(),
                            [&](std::string_view step, std::size_t, std::size_t) {
                              steps.emplace(step);
                              return Status();
                            });
  ASSERT_TRUE(run.has_value()) << run.error().message();
  EXPECT_TRUE(steps.contains("keyframes") && steps.contains("submaps"));
  ASSERT_EQ(run->sessions.size(), 2U);
  EXPECT_EQ(run->sessions[0].key.vehicle, "b");
  EXPECT_FALSE(run->plan.sessions[1].is_joined) << "they saw nothing of each other";
  EXPECT_EQ(run->left_out.size(), 1U);
  EXPECT_EQ(run->revision, 98U);
  EXPECT_TRUE(run->IsNothing());
}

TEST(MergeRunTest, OfNothingIsNothing) {
  ListedSessions source;
  const auto run = RunMerge(source, {}, {}, testing::SharedWork(), nullptr);
  ASSERT_TRUE(run.has_value()) << run.error().message();
  EXPECT_TRUE(run->IsNothing());
  EXPECT_TRUE(run->Picture().sessions.empty());
}

TEST(MergeRunTest, OptionsThatAreNoneAreSaidBeforeAnythingIsRead) {
  ListedSessions source;
  source.Add({"a", "day"}, "staged", 2);
  MergeOptions options;
  options.workers = 0;
  const auto run = RunMerge(source, {}, options, testing::SharedWork(),
                            [](std::string_view, std::size_t, std::size_t) {
                              ADD_FAILURE() << "it reads";
                              return Status();
                            });
  ASSERT_FALSE(run.has_value());
  EXPECT_EQ(run.error().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace atlas
