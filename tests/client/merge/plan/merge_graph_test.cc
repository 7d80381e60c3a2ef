// Links, closures and priors of sessions as one graph, and its solution by session again.
#include "client/merge/plan/merge_graph.h"

#include <gtest/gtest.h>

#include "tests/client/merge/plan/blind_session.h"

namespace atlas {
namespace {

using testing::At;
using testing::BlindSession;
using testing::DistanceBetween;
using testing::Straight;

// Two sessions on one road, the second stored 4 m to the left of where it was; 1 m between
// keyframes.
class MergeGraphTest : public ::testing::Test {
 protected:
  MergeGraphTest()
      : sessions_{BlindSession("one", Straight(At(0.0), 30)),
                  BlindSession("two", Straight(At(0.0, 4.0), 50))},
        is_held_(2, false),
        uses_priors_(2, true) {
    const MapProfile profile;
    links_ =
        LinkSessions(sessions_, StoredPoses(sessions_), {profile, options_, testing::SharedWork()})
            .value();
  }

  // Where they truly lie to each other.
  void Meet() {
    for (const std::size_t i : {0U, 1U, 2U}) {
      closures_.push_back(testing::FoundAsStored(sessions_, {0, i}, {1, i}));
      Pose& T_a_b = closures_.back().match.T_a_b;
      const Pose T_world_a = StoredPose(sessions_[0], sessions_[0].submaps[i]);
      T_a_b = T_world_a.inverse() * At(0.0, -4.0) * T_world_a * T_a_b;
    }
  }

  MergedPoses Solve() const {
    return OptimizeMerge({sessions_, links_, closures_, is_held_, uses_priors_},
                         StoredPoses(sessions_), options_)
        .value();
  }

  double LeftOf(const MergedPoses& merged, std::size_t session, std::size_t submap) const {
    return merged.T_world_submap[session][submap].translation().y();
  }

  std::vector<MergeSession> sessions_;
  std::vector<std::vector<SessionLink>> links_;
  std::vector<FoundClosure> closures_;
  std::vector<bool> is_held_;
  std::vector<bool> uses_priors_;
  MergeOptions options_;
};

TEST_F(MergeGraphTest, WithNothingToSayAllStays) {
  const MergedPoses merged = Solve();
  ASSERT_EQ(merged.T_world_submap.size(), 2U);
  ASSERT_EQ(merged.T_world_submap[0].size(), sessions_[0].submaps.size());
  ASSERT_EQ(merged.T_world_submap[1].size(), sessions_[1].submaps.size());
  const SubmapPoses stored = StoredPoses(sessions_);
  for (const std::size_t session : {0U, 1U}) {
    for (std::size_t i = 0; i < stored[session].size(); ++i) {
      EXPECT_LT(DistanceBetween(merged.T_world_submap[session][i], stored[session][i]), 1e-6);
    }
  }
  EXPECT_TRUE(merged.closure_off_sigmas.empty());
}

TEST_F(MergeGraphTest, ClosuresBringTheSecondToTheFirst) {
  Meet();
  const MergedPoses merged = Solve();
  EXPECT_EQ(merged.closure_off_sigmas.size(), 3U);
  for (const double off : merged.closure_off_sigmas) EXPECT_LT(off, 0.5);
  for (std::size_t i = 0; i < sessions_[0].submaps.size(); ++i) {
    EXPECT_NEAR(LeftOf(merged, 0, i), 0.0, 0.01) << i;
  }
  for (std::size_t i = 0; i < sessions_[1].submaps.size(); ++i) {
    EXPECT_NEAR(LeftOf(merged, 1, i), 0.0, 0.05) << i;
  }
}

// Whatever the order in which sessions are given: the map does not go to a staged one.
TEST_F(MergeGraphTest, AStagedSessionGoesToTheMap) {
  Meet();
  sessions_[0] = testing::Staged(std::move(sessions_[0]));
  const MergedPoses merged = Solve();
  const SubmapPoses stored = StoredPoses(sessions_);
  EXPECT_EQ(merged.T_world_submap[1][0].translation(), stored[1][0].translation());
  for (std::size_t i = 0; i < stored[0].size(); ++i) {
    EXPECT_NEAR(LeftOf(merged, 0, i), 4.0, 0.05) << i;
  }
  for (std::size_t i = 0; i < stored[1].size(); ++i) {
    EXPECT_NEAR(LeftOf(merged, 1, i), 4.0, 0.05) << i;
  }
}

TEST_F(MergeGraphTest, WhoIsHeldStays) {
  Meet();
  is_held_[1] = true;
  const MergedPoses merged = Solve();
  const SubmapPoses stored = StoredPoses(sessions_);
  for (std::size_t i = 0; i < stored[1].size(); ++i) {
    EXPECT_EQ(merged.T_world_submap[1][i].translation(), stored[1][i].translation());
  }
  for (std::size_t i = 0; i < stored[0].size(); ++i) {
    EXPECT_NEAR(LeftOf(merged, 0, i), 4.0, 0.05) << i;
  }
}

// One that two others and the odometry contradict pulls nobody.
TEST_F(MergeGraphTest, WhatIsLeftOfAClosureIsCounted) {
  Meet();
  closures_[1].match.T_a_b = At(0.0, 0.0, 3.0) * closures_[1].match.T_a_b;
  const MergedPoses merged = Solve();
  EXPECT_GT(merged.closure_off_sigmas[1], 100.0);
  EXPECT_LT(merged.closure_off_sigmas[0], 3.0);
}

// Keyframes that know where they are: all of them a metre to the right, and up.
TEST_F(MergeGraphTest, PriorsMoveASessionAsOne) {
  for (std::size_t i = 0; i < sessions_[1].keyframes.size(); i += 2) {
    MergeKeyframe& keyframe = sessions_[1].keyframes[i];
    keyframe.prior = KeyframePrior{
        keyframe.T_world_sensor.ToPose().translation() + Eigen::Vector3d(0.0, -1.0, 0.5), 0.3};
  }
  const MergedPoses merged = Solve();
  for (std::size_t i = 0; i < sessions_[1].submaps.size(); ++i) {
    EXPECT_NEAR(LeftOf(merged, 1, i), 3.0, 0.02) << i;
    EXPECT_NEAR(merged.T_world_submap[1][i].translation().z(), 0.5, 0.02) << i;
    EXPECT_NEAR(merged.T_world_submap[1][i].translation().x(),
                StoredPoses(sessions_)[1][i].translation().x(), 0.02)
        << i;
  }
  EXPECT_NEAR(LeftOf(merged, 0, 0), 0.0, 1e-9);
}

// Ten keyframes of a submap that err together know no more than one of them: as much as the match.
TEST_F(MergeGraphTest, PriorsOfOneMomentAreAsGoodAsOneOfThem) {
  sessions_[1] = BlindSession("two", Straight(At(0.0), 10));
  links_[1].clear();
  is_held_[0] = true;
  closures_ = {testing::FoundAsStored(sessions_, {0, 0}, {1, 0})};
  for (MergeKeyframe& keyframe : sessions_[1].keyframes) {
    keyframe.prior = KeyframePrior{
        keyframe.T_world_sensor.ToPose().translation() + Eigen::Vector3d(0.0, 0.1, 0.0),
        options_.match_sigma_m};
  }
  options_.graph.robust_sigmas = 1e6;
  EXPECT_NEAR(LeftOf(Solve(), 1, 0), 0.05, 0.005);
}

// What errs for half a minute is known once in half a minute.
TEST_F(MergeGraphTest, PriorsCountByTheTimeThatTheyTook) {
  for (const std::int64_t apart_ms : {250, 60'000}) {
    sessions_[1] = BlindSession("two", Straight(At(0.0), 10));
    links_[1].clear();
    is_held_[0] = true;
    closures_ = {testing::FoundAsStored(sessions_, {0, 0}, {1, 0})};
    std::int64_t time_ms = 0;
    for (MergeKeyframe& keyframe : sessions_[1].keyframes) {
      keyframe.time_ms = time_ms += apart_ms;
      keyframe.prior = KeyframePrior{
          keyframe.T_world_sensor.ToPose().translation() + Eigen::Vector3d(0.0, 0.11, 0.0),
          options_.match_sigma_m};
    }
    options_.graph.robust_sigmas = 1e6;
    EXPECT_NEAR(LeftOf(Solve(), 1, 0), apart_ms < 1'000 ? 0.055 : 0.1, 0.005);
  }
}

// Each of them by itself, not the mean of a submap's.
TEST_F(MergeGraphTest, APriorFarOffPullsNobody) {
  for (std::size_t i = 0; i < sessions_[1].keyframes.size(); ++i) {
    MergeKeyframe& keyframe = sessions_[1].keyframes[i];
    const Eigen::Vector3d off(0.0, i % 10 == 4 ? 20.0 : -1.0, 0.0);  // in every submap one
    keyframe.prior = KeyframePrior{keyframe.T_world_sensor.ToPose().translation() + off, 0.3};
  }
  const MergedPoses merged = Solve();
  for (std::size_t i = 0; i < sessions_[1].submaps.size(); ++i) {
    EXPECT_NEAR(LeftOf(merged, 1, i), 3.0, 0.03) << i;
  }
}

TEST_F(MergeGraphTest, PriorsThatAreNotUsedSayNothing) {
  for (MergeKeyframe& keyframe : sessions_[1].keyframes) {
    keyframe.prior = KeyframePrior{Eigen::Vector3d(0.0, 70.0, 0.0), 0.1};
  }
  uses_priors_[1] = false;
  EXPECT_NEAR(LeftOf(Solve(), 1, 0), 4.0, 1e-9);
}

TEST_F(MergeGraphTest, PriorsOfAHeldSessionSayNothing) {
  for (MergeKeyframe& keyframe : sessions_[1].keyframes) {
    keyframe.prior = KeyframePrior{Eigen::Vector3d(0.0, 70.0, 0.0), 0.0};  // no sigma at all
  }
  is_held_[1] = true;
  EXPECT_NEAR(LeftOf(Solve(), 1, 0), 4.0, 1e-9);
}

TEST_F(MergeGraphTest, APriorWithoutARadiusIsRefused) {
  sessions_[1].keyframes[0].prior = KeyframePrior{Eigen::Vector3d::Zero(), 0.0};
  const auto merged = OptimizeMerge({sessions_, links_, closures_, is_held_, uses_priors_},
                                    StoredPoses(sessions_), options_);
  ASSERT_FALSE(merged.has_value());
  EXPECT_EQ(merged.error().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace atlas
