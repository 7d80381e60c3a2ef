// Which pairs of submaps are looked at, told from how many there are: of those that saw nothing
// none is found.
#include "client/merge/plan/closure_search.h"

#include <memory>
#include <set>
#include <utility>

#include <gtest/gtest.h>

#include "client/merge/plan/session_links.h"
#include "tests/client/merge/plan/blind_session.h"
#include "tests/client/merge/plan/simulated_session.h"

namespace atlas {
namespace {

using testing::At;
using testing::BlindSession;
using testing::Straight;

class ClosureSearchTest : public ::testing::Test {
 protected:
  void Add(const std::vector<Pose>& poses) {
    sessions_.push_back(BlindSession("car" + std::to_string(sessions_.size()), poses));
    part_of_.push_back(0);
  }

  ClosureSearch Make() {
    ways_.clear();
    for (const MergeSession& session : sessions_) ways_.push_back(WayOf(session, {}));
    return {sessions_, ways_, {profile_, options_, testing::SharedWork()}};
  }

  // Pairs that are looked at.
  std::size_t Near(ClosureSearch& search, const std::vector<FoundClosure>& known = {}) const {
    std::size_t pairs = 0;
    const auto found = search.SearchNear(StoredPoses(sessions_), part_of_, known,
                                         [&](std::size_t, std::size_t all) {
                                           pairs = all;
                                           return Status();
                                         });
    EXPECT_TRUE(found.has_value() && found->empty());
    return pairs;
  }
  std::size_t Near() {
    ClosureSearch search = Make();
    return Near(search);
  }

  MapProfile profile_;
  MergeOptions options_;
  std::vector<MergeSession> sessions_;
  std::vector<SessionWay> ways_;
  std::vector<std::size_t> part_of_;
};

TEST_F(ClosureSearchTest, EachSubmapIsComparedWithTheNearestOfOtherSessions) {
  Add(Straight(At(0.0), 50));
  Add(Straight(At(0.0, 3.0), 50));  // beside it, five each
  options_.guided_neighbours = 1;
  EXPECT_EQ(Near(), 5U);
  options_.guided_neighbours = 2;
  options_.guided_m = 12.0;
  EXPECT_EQ(Near(), 10U);
  options_.guided_neighbours = 3;
  EXPECT_EQ(Near(), 13U);  // those at the ends have two
}

TEST_F(ClosureSearchTest, WhatIsFarOffIsNot) {
  Add(Straight(At(0.0), 50));
  Add(Straight(At(0.0, 13.0), 50));
  EXPECT_EQ(Near(), 0U);
  options_.guided_m = 13.1;
  EXPECT_GT(Near(), 0U);
}

TEST_F(ClosureSearchTest, AnotherDeckIsNot) {
  Add(Straight(At(0.0), 50));
  Add(Straight(At(0.0, 0.0, 1.5), 50));
  EXPECT_EQ(Near(), 0U);
  options_.guided_height_m = 2.0;
  EXPECT_GT(Near(), 0U);
}

TEST_F(ClosureSearchTest, HeightIsNoDistance) {
  Add(Straight(At(0.0), 50));
  Add(Straight(At(0.0, 2.95, 0.9), 50));
  options_.guided_m = 3.0;
  EXPECT_EQ(Near(), 5U);
}

TEST_F(ClosureSearchTest, AnotherPartIsNot) {
  Add(Straight(At(0.0), 50));
  Add(Straight(At(0.0, 3.0), 50));
  part_of_ = {0, 1};
  EXPECT_EQ(Near(), 0U);
}

TEST_F(ClosureSearchTest, WhatIsKnownOrWasLookedAtIsNotAgain) {
  Add(Straight(At(0.0), 50));
  Add(Straight(At(0.0, 3.0), 50));
  options_.guided_neighbours = 1;
  ClosureSearch search = Make();
  EXPECT_EQ(Near(search, {testing::Found({0, 2}, {1, 2}, At(0.0))}), 4U);
  EXPECT_EQ(Near(search), 0U);
}

// There and back: of one session only what is a loop, whatever lies beside each other.
TEST_F(ClosureSearchTest, OfOneSessionNeighboursDoNotMeet) {
  std::vector<Pose> poses = Straight(At(0.0), 60);
  const std::vector<Pose> back = Straight(At(59.0, 3.0, 0.0, 3.14159265), 60);
  poses.insert(poses.end(), back.begin(), back.end());
  Add(poses);
  options_.guided_neighbours = 1;
  options_.min_loop_m = 50.0;
  const std::size_t loops = Near();
  EXPECT_GT(loops, 2U);
  EXPECT_LT(loops, 6U);
  options_.min_loop_m = 200.0;
  EXPECT_EQ(Near(), 0U);
}

TEST_F(ClosureSearchTest, ProgressThatFailsEndsIt) {
  Add(Straight(At(0.0), 50));
  Add(Straight(At(0.0, 3.0), 50));
  ClosureSearch search = Make();
  const auto stop = [](std::size_t done, std::size_t) {
    return done == 2 ? Status(StatusCode::kTimeout, "enough") : Status();
  };
  const auto near = search.SearchNear(StoredPoses(sessions_), part_of_, {}, stop);
  ASSERT_FALSE(near.has_value());
  EXPECT_EQ(near.error(), Status(StatusCode::kTimeout, "enough"));
  const auto anywhere = search.SearchAnywhere(stop);
  ASSERT_FALSE(anywhere.has_value());
  EXPECT_EQ(anywhere.error().code(), StatusCode::kTimeout);
}

// A session that is one submap, and a later one that comes by there halfway.
class StreetSearchTest : public ClosureSearchTest {
 protected:
  void Make(const Pose& T_frame_world) {
    const testing::DrivePiece piece{.seed = 0, .first = 36, .count = 40};
    other_ = std::make_unique<testing::SimulatedSession>("other", piece, T_frame_world);
    for (const auto* drive : {&one_, other_.get()}) {
      sessions_.push_back(drive->session());
      MergeSession& session = sessions_.back();
      ASSERT_TRUE(BuildSubmaps(session, StoredPoses(session), drive->reader(),
                               {profile_, options_, testing::SharedWork()}, {}, nullptr)
                      .ok());
    }
    ASSERT_EQ(sessions_[0].submaps.size(), 1U);
  }

  // Each pair once, and where they truly lie to each other.
  void ExpectFound() {
    const auto found = ClosureSearchTest::Make().SearchAnywhere(nullptr);
    ASSERT_TRUE(found.has_value());
    ASSERT_FALSE(found->empty());
    std::set<std::pair<SubmapRef, SubmapRef>> pairs;
    for (const FoundClosure& closure : *found) {
      EXPECT_TRUE(pairs.emplace(closure.a, closure.b).second);
      EXPECT_EQ(closure.a, (SubmapRef{0, 0}));
      ASSERT_EQ(closure.b.session, 1U);
      const Pose should =
          one_.TruthOf(sessions_[0], 0).inverse() * other_->TruthOf(sessions_[1], closure.b.submap);
      EXPECT_LT(testing::DistanceBetween(closure.match.T_a_b, should), 0.05);
      EXPECT_LT(testing::AngleBetween(closure.match.T_a_b, should), 0.005);
    }
  }

  testing::SimulatedSession one_{"one", {.seed = 2, .first = 62, .count = 8}};
  std::unique_ptr<testing::SimulatedSession> other_;
};

// The later one's first submap, the only other that is looked for, is not there.
TEST_F(StreetSearchTest, AnEarlierSessionIsFoundInALaterOne) {
  Make(At(900.0, 0.0, 0.0, 1.0));
  options_.probe_stride = 100;
  ExpectFound();
}

TEST_F(StreetSearchTest, WhatIsFoundByLooksAndByPosesIsOne) {
  Make(Pose::Identity());
  options_.probe_stride = 1;
  ExpectFound();
}

}  // namespace
}  // namespace atlas
