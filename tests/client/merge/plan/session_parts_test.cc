// Sessions that meet lie in one frame: that of the map, where it is among them.
#include "client/merge/plan/session_parts.h"

#include <gtest/gtest.h>

#include "tests/client/merge/plan/blind_session.h"

namespace atlas {
namespace {

using testing::At;

// Each session has the world by its own frame.
class SessionPartsTest : public ::testing::Test {
 protected:
  static constexpr std::size_t kSubmaps = 4;

  // `count` sessions, all along one road; those of `staged` are not in the map.
  void Make(std::size_t count, const std::vector<std::size_t>& staged) {
    sessions_ = std::vector<MergeSession>(count);
    for (const std::size_t i : staged) sessions_[i].is_staged = true;
    for (std::size_t i = 0; i < count; ++i) {
      const auto number = static_cast<double>(i);
      T_world_frame_.push_back(At(100.0 * number, -3.0 * number, 0.5 * number, 0.4 * number));
      SessionWay way;
      for (std::size_t k = 0; k < kSubmaps; ++k) {
        way.T_session_submap.push_back(T_world_frame_[i].inverse() * Truth(i, k));
        way.way_m.push_back(10.0 * static_cast<double>(k));
      }
      ways_.push_back(way);
    }
  }

  static Pose Truth(std::size_t session, std::size_t submap) {
    return At(10.0 * static_cast<double>(submap) + static_cast<double>(session), 0.0, 0.0,
              0.7 * static_cast<double>(session + submap));
  }

  void Meet(std::size_t a, std::size_t b, std::size_t agreeing = 3, bool is_believed = true) {
    choice_.meetings.push_back({a, b, agreeing, agreeing, 0.0, is_believed});
    if (!is_believed) return;
    choice_.believed.push_back(
        testing::Found({a, 1}, {b, 2}, Truth(a, 1).inverse() * Truth(b, 2), 0.9));
    choice_.believed.push_back(  // less likely, and wrong
        testing::Found({a, 0}, {b, 0}, Truth(a, 0).inverse() * Truth(b, 0) * At(0.2), 0.7));
  }

  SessionParts PutTogether() const { return atlas::PutTogether(sessions_, ways_, choice_); }

  void ExpectInFrameOf(std::size_t session, std::size_t frame, const SessionParts& parts) const {
    ASSERT_EQ(parts.T_world_submap[session].size(), kSubmaps);
    for (std::size_t k = 0; k < kSubmaps; ++k) {
      const Pose should = T_world_frame_[frame].inverse() * Truth(session, k);
      EXPECT_TRUE(parts.T_world_submap[session][k].isApprox(should, 1e-9)) << session << " " << k;
    }
  }

  std::vector<MergeSession> sessions_;
  std::vector<SessionWay> ways_;
  std::vector<Pose> T_world_frame_;
  ClosureChoice choice_;
};

using Numbers = std::vector<std::size_t>;

TEST_F(SessionPartsTest, WhoMeetsNobodyIsAPartOfItsOwn) {
  Make(3, {1});
  const SessionParts parts = PutTogether();
  EXPECT_EQ(parts.part_of, (Numbers{0, 1, 2}));
  for (const std::size_t i : {0U, 1U, 2U}) ExpectInFrameOf(i, i, parts);
}

TEST_F(SessionPartsTest, WhoMeetsIsPutIntoTheFirstOnesFrame) {
  Make(3, {});
  Meet(0, 1);
  Meet(1, 2);
  const SessionParts parts = PutTogether();
  EXPECT_EQ(parts.part_of, (Numbers{0, 0, 0}));
  for (const std::size_t i : {0U, 1U, 2U}) ExpectInFrameOf(i, 0, parts);
}

TEST_F(SessionPartsTest, TheMapGivesTheFrame) {
  Make(4, {0, 1, 3});
  Meet(0, 1);
  Meet(1, 2);
  Meet(0, 3);
  const SessionParts parts = PutTogether();
  EXPECT_EQ(parts.part_of, (Numbers{2, 2, 2, 2}));
  for (const std::size_t i : {0U, 1U, 2U, 3U}) ExpectInFrameOf(i, 2, parts);
}

TEST_F(SessionPartsTest, OfStagedOnesTheFirstGivesTheFrame) {
  Make(2, {0, 1});
  Meet(0, 1);
  const SessionParts parts = PutTogether();
  EXPECT_EQ(parts.part_of, (Numbers{0, 0}));
  ExpectInFrameOf(1, 0, parts);
}

TEST_F(SessionPartsTest, TwoPartsStayTwo) {
  Make(5, {1, 3, 4});
  Meet(0, 3);
  Meet(1, 4);
  Meet(0, 1, 2, false);
  const SessionParts parts = PutTogether();
  EXPECT_EQ(parts.part_of, (Numbers{0, 1, 2, 0, 1}));
  ExpectInFrameOf(3, 0, parts);
  ExpectInFrameOf(4, 1, parts);
}

// A session that meets itself goes nowhere by that.
TEST_F(SessionPartsTest, AMeetingWithItselfJoinsNobody) {
  Make(2, {});
  choice_.meetings.push_back({1, 1, 3, 3, 0.0, true});
  choice_.believed.push_back(testing::Found({1, 0}, {1, 3}, At(0.0)));
  EXPECT_EQ(PutTogether().part_of, (Numbers{0, 1}));
}

// By the meeting with more closures, though the other comes first and is a little off.
TEST_F(SessionPartsTest, TheStrongestMeetingPlaces) {
  Make(3, {1, 2});
  Meet(0, 2, 3);
  choice_.believed.front().match.T_a_b = choice_.believed.front().match.T_a_b * At(0.3);
  Meet(0, 1, 5);
  Meet(1, 2, 4);
  const SessionParts parts = PutTogether();
  for (const std::size_t i : {0U, 1U, 2U}) ExpectInFrameOf(i, 0, parts);
}

}  // namespace
}  // namespace atlas
