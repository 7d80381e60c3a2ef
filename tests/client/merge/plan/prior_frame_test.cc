// Whose positions are used, and where they put what is not in the map.
#include "client/merge/plan/prior_frame.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/client/merge/plan/blind_session.h"

namespace atlas {
namespace {

using testing::At;
using testing::BlindSession;
using testing::DistanceBetween;
using testing::Straight;

// Two sessions of one part, and one that is a part by itself.
class PriorFrameTest : public ::testing::Test {
 protected:
  PriorFrameTest()
      : sessions_{BlindSession("one", Straight(At(0.0), 60)),
                  BlindSession("two", Straight(At(30.0, 4.0), 60)),
                  BlindSession("far", Straight(At(900.0), 60))},
        before_(StoredPoses(sessions_)) {}

  // Every other keyframe's, where `T_world_part` has it.
  void Know(std::size_t session, const Pose& T_world_part, double radius_m = 0.5) {
    for (std::size_t i = 0; i < sessions_[session].keyframes.size(); i += 2) {
      MergeKeyframe& keyframe = sessions_[session].keyframes[i];
      keyframe.prior =
          KeyframePrior{T_world_part * keyframe.T_world_sensor.ToPose().translation(), radius_m};
    }
  }
  void Stage(std::size_t session) { sessions_[session].is_staged = true; }
  void StageAll() {
    for (const std::size_t i : {0U, 1U, 2U}) Stage(i);
  }
  void Place() {
    after_ = before_;
    uses_ = PlaceByPriors(sessions_, {0, 0, 2}, is_held_, PriorOptions(), after_);
    ASSERT_EQ(uses_.size(), 3U);
  }
  void ExpectAt(std::size_t session, const Pose& T_new_old) const {
    for (std::size_t k = 0; k < after_[session].size(); ++k) {
      EXPECT_LT(DistanceBetween(after_[session][k], T_new_old * before_[session][k]), 1e-3)
          << session << " " << k;
    }
  }
  void ExpectUnused(std::size_t session, const std::string& why) const {
    EXPECT_FALSE(uses_[session].is_used);
    EXPECT_NE(uses_[session].why_not.find(why), std::string::npos) << uses_[session].why_not;
  }

  const Pose T_world_part_ = At(-700.0, 40.0, 9.0, 1.2);
  std::vector<MergeSession> sessions_;
  SubmapPoses before_;
  SubmapPoses after_;
  std::vector<bool> is_held_ = {false, false, false};
  std::vector<PriorUse> uses_;
};

TEST_F(PriorFrameTest, WithoutPositionsNothingMoves) {
  Place();
  for (const std::size_t i : {0U, 1U, 2U}) {
    EXPECT_EQ(uses_[i].count, 0U);
    EXPECT_FALSE(uses_[i].is_used);
    EXPECT_EQ(uses_[i].why_not, "");
    ExpectAt(i, Pose::Identity());
  }
}

TEST_F(PriorFrameTest, APartThatIsStagedGoesWhereItsPositionsAreAsAWhole) {
  StageAll();
  Know(1, T_world_part_);  // of one of the two
  Place();
  EXPECT_EQ(uses_[1].count, 30U);
  EXPECT_TRUE(uses_[1].is_used);
  EXPECT_FALSE(uses_[0].is_used) << "it has none";
  ExpectAt(0, T_world_part_);
  ExpectAt(1, T_world_part_);
  ExpectAt(2, Pose::Identity());
}

TEST_F(PriorFrameTest, PartsAreJudgedEachForItself) {
  StageAll();
  Know(0, T_world_part_);
  Know(2, At(1.0), 30.0);
  Place();
  EXPECT_TRUE(uses_[0].is_used);
  ExpectUnused(2, "too near each other");
  ExpectAt(2, Pose::Identity());
}

TEST_F(PriorFrameTest, ASessionThatContradictsTheOthersIsNotUsed) {
  StageAll();
  Know(0, T_world_part_);
  for (std::size_t i = 1; i < 12; i += 2) {  // more of it
    sessions_[0].keyframes[i].prior = KeyframePrior{
        T_world_part_ * sessions_[0].keyframes[i].T_world_sensor.ToPose().translation(), 0.5};
  }
  Know(1, At(70.0, -900.0));
  Place();
  EXPECT_TRUE(uses_[0].is_used);
  ExpectUnused(1, "30 of 30 have it elsewhere than those of the others");
  ExpectAt(0, T_world_part_);
  ExpectAt(1, T_world_part_);
}

TEST_F(PriorFrameTest, WhereNoneIsBelievedAllStays) {
  StageAll();
  for (std::size_t i = 0; i < 60; ++i) {
    const double number = static_cast<double>(i);
    sessions_[0].keyframes[i].prior =
        KeyframePrior{At(90.0 * number, 7.0 * number * number).translation(), 0.5};
  }
  Place();
  ExpectUnused(0, "do not agree");
  ExpectAt(0, Pose::Identity());
  ExpectAt(1, Pose::Identity());
}

// Of the map nothing is moved for the sake of positions.
TEST_F(PriorFrameTest, AMapThatIsHeldStaysAndPositionsElsewhereAreNotUsed) {
  Stage(1);
  is_held_[0] = true;
  for (const double off_m : {0.0, 0.9, 5.0, 700.0}) {
    Know(0, At(0.0));
    Know(1, At(0.0, off_m));
    Place();
    EXPECT_TRUE(uses_[0].is_used);
    EXPECT_EQ(uses_[1].is_used, off_m < 1.0) << off_m;
    if (off_m > 1.0) ExpectUnused(1, "30 of 30 have it elsewhere than the map, which stays");
    ExpectAt(0, Pose::Identity());
    ExpectAt(1, Pose::Identity());
  }
}

TEST_F(PriorFrameTest, AMapThatIsNotHeldMovesAsFarAsItMayHaveDrifted) {
  Stage(1);
  Know(0, At(0.0, 3.0, -1.0));
  Place();
  EXPECT_TRUE(uses_[0].is_used);
  ExpectAt(0, At(0.0, 3.0, -1.0));
  ExpectAt(1, At(0.0, 3.0, -1.0));
  Know(0, T_world_part_);
  Place();
  ExpectUnused(0, "another frame");
  ExpectAt(0, Pose::Identity());
  ExpectAt(1, Pose::Identity());
}

TEST_F(PriorFrameTest, HowFarHalfOfThemAreOff) {
  EXPECT_EQ(MedianOff(sessions_[0], before_[0]), 0.0);
  Know(0, At(0.0, 0.7));
  sessions_[0].keyframes[4].prior->p_world.x() += 1e4;
  EXPECT_NEAR(MedianOff(sessions_[0], before_[0]), 0.7, 1e-6);
}

}  // namespace
}  // namespace atlas
