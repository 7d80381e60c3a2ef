// Who lies where matches say stays; who does not is let go, and drags nobody along.
#include "client/merge/plan/held_sessions.h"

#include <numbers>

#include <gtest/gtest.h>

#include "tests/client/merge/plan/blind_session.h"

namespace atlas {
namespace {

using testing::At;
using testing::BlindSession;
using testing::FoundAsStored;
using testing::Staged;
using testing::Straight;

using Held = std::vector<bool>;
constexpr double kDegree = std::numbers::pi / 180.0;

class HeldSessionsTest : public ::testing::Test {
 protected:
  // Five submaps each, in the map, beside each other.
  void Make(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      sessions_.push_back(
          BlindSession("car" + std::to_string(i), Straight(At(0.0, static_cast<double>(i)), 50)));
      ASSERT_EQ(sessions_.back().submaps.size(), 5U);
    }
    links_.resize(count);
  }

  // Three closures, each `off` from where the poses have them.
  void Meet(std::size_t a, std::size_t b, const Pose& off = Pose::Identity()) {
    for (const std::size_t i : {0U, 2U, 4U}) {
      closures_.push_back(FoundAsStored(sessions_, {a, i}, {b, i}, off));
    }
  }

  void Link(std::size_t session, const Pose& off, bool is_matched = true) {
    const std::vector<Pose> poses = StoredPoses(sessions_)[session];
    for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
      links_[session].push_back({i, i + 1, off * (poses[i].inverse() * poses[i + 1]),
                                 PoseInformation6::Identity(), is_matched});
    }
  }

  Held HeldOnes() const { return HeldSessions(sessions_, links_, closures_, options_); }

  std::vector<MergeSession> sessions_;
  std::vector<std::vector<SessionLink>> links_;
  std::vector<FoundClosure> closures_;
  MergeOptions options_;
};

TEST_F(HeldSessionsTest, WhereNothingSpeaksAgainstItTheMapStays) {
  Make(2);
  EXPECT_EQ(HeldOnes(), (Held{true, true}));
  Meet(0, 1, At(0.03, 0.0, 0.0, 0.1 * kDegree));
  Link(0, At(0.0, 0.03, 0.0, -0.1 * kDegree));
  EXPECT_EQ(HeldOnes(), (Held{true, true}));
}

TEST_F(HeldSessionsTest, AStagedOneIsNeverHeldAndDragsNobody) {
  Make(2);
  sessions_[1] = Staged(std::move(sessions_[1]));
  EXPECT_EQ(HeldOnes(), (Held{true, false}));
  Meet(0, 1, At(5.0));
  EXPECT_EQ(HeldOnes(), (Held{true, false}));
}

TEST_F(HeldSessionsTest, OneThatDriftsWithinItselfIsLetGo) {
  Make(2);
  Meet(0, 1);
  Link(0, At(0.05));
  Link(1, At(0.0, 0.0, 0.0, 0.2 * kDegree));
  EXPECT_EQ(HeldOnes(), (Held{false, false}));
  options_.held_m = 0.06;
  options_.held_rad = 0.25 * kDegree;
  EXPECT_EQ(HeldOnes(), (Held{true, true}));
}

// A map does not move because somebody was merged who has nothing to do with it.
TEST_F(HeldSessionsTest, OneThatMeetsNobodyStaysUnlessItsPositionsAreKnown) {
  Make(2);
  Link(0, At(0.05));
  Link(1, At(0.05));
  EXPECT_EQ(HeldOnes(), (Held{true, true}));
  sessions_[0].keyframes[3].prior = {Eigen::Vector3d::Zero(), 0.5};
  EXPECT_EQ(HeldOnes(), (Held{false, true}));
  closures_.push_back(FoundAsStored(sessions_, {1, 0}, {1, 4}));  // it meets itself
  EXPECT_EQ(HeldOnes(), (Held{false, false}));
}

// They say what the poses say, whatever that is.
TEST_F(HeldSessionsTest, OdometryIsNoWitness) {
  Make(1);
  Link(0, At(1.0), false);
  EXPECT_EQ(HeldOnes(), (Held{true}));
}

TEST_F(HeldSessionsTest, OfTwoThatDoNotFitTheEarlierStays) {
  Make(2);
  Meet(0, 1, At(0.5));
  EXPECT_EQ(HeldOnes(), (Held{true, false}));
}

TEST_F(HeldSessionsTest, ATurnAloneIsAMisfit) {
  Make(2);
  Meet(0, 1, At(0.0, 0.0, 0.0, 0.3 * kDegree));
  EXPECT_EQ(HeldOnes(), (Held{true, false}));
}

// The one that fits nobody goes, wherever it stands among the others.
TEST_F(HeldSessionsTest, TheOneThatIsOffIsLetGoAndNotThoseThatItMeets) {
  for (const std::size_t off : {0U, 1U, 2U, 3U}) {
    sessions_.clear();
    closures_.clear();
    Make(4);
    Held expected(4, true);
    expected[off] = false;
    for (std::size_t a = 0; a < 4; ++a) {
      for (std::size_t b = a + 1; b < 4; ++b) {
        Meet(a, b, a == off || b == off ? At(0.3) : At(0.01));
      }
    }
    EXPECT_EQ(HeldOnes(), expected) << off;
  }
}

// A long way that fits does not hide a piece that does not: a share of its squares does.
TEST_F(HeldSessionsTest, MisfitsAreRootMeanSquare) {
  Make(2);
  for (std::size_t i = 0; i < 4; ++i) {
    closures_.push_back(FoundAsStored(sessions_, {0, i}, {1, i}));
  }
  closures_.push_back(FoundAsStored(sessions_, {0, 4}, {1, 4}, At(0.085)));  // 0.038 of five
  EXPECT_EQ(HeldOnes(), (Held{true, true}));
  closures_.back() = FoundAsStored(sessions_, {0, 4}, {1, 4}, At(0.095));  // 0.042
  EXPECT_EQ(HeldOnes(), (Held{true, false}));
}

TEST_F(HeldSessionsTest, ALoopOfItsOwnThatDoesNotCloseLetsGo) {
  Make(2);
  closures_.push_back(FoundAsStored(sessions_, {1, 0}, {1, 4}, At(0.2)));
  EXPECT_EQ(HeldOnes(), (Held{true, false}));
}

// By where a session is stored, not by where its submaps were fused the last time.
TEST_F(HeldSessionsTest, SubmapsFusedElsewhereAreWhereTheyAreStored) {
  Make(2);
  Meet(0, 1);
  const Pose moved = At(3.0, 0.0, 0.0, 0.1);
  for (Pose& pose : sessions_[1].T_world_sensor) pose = moved * pose;
  for (MergeSubmap& submap : sessions_[1].submaps) {
    submap.T_world_submap = moved * submap.T_world_submap;
  }
  EXPECT_EQ(HeldOnes(), (Held{true, true}));
}

}  // namespace
}  // namespace atlas
