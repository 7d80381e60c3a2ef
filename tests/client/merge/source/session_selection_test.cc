// Which sessions of a source are merged, and what of them.
#include "client/merge/source/session_selection.h"

#include <gtest/gtest.h>

#include "tests/client/merge/source/listed_sessions.h"

namespace atlas {
namespace {

using testing::ListedSessions;

class SessionSelectionTest : public ::testing::Test {
 protected:
  Result<ReadSessions> Read(const std::vector<SessionKey>& wanted = {}) {
    return ReadForMerge(source_, wanted, spool_, progress_);
  }
  ReadSessions MustRead(const std::vector<SessionKey>& wanted = {}) {
    auto read = Read(wanted);
    EXPECT_TRUE(read.has_value()) << read.error().message();
    return read ? *std::move(read) : ReadSessions();
  }

  static std::string NamesOf(const std::vector<MergeSession>& sessions) {
    std::string names;
    for (const MergeSession& session : sessions) names += session.key.vehicle + " ";
    return names;
  }
  static std::string WhyOf(const ReadSessions& read, const std::string& vehicle) {
    for (const LeftOut& one : read.left_out) {
      if (one.key.vehicle == vehicle) return one.why;
    }
    return "";
  }

  ListedSessions source_;
  KeyframeSpool spool_ = *KeyframeSpool::Create();
  std::function<Status(std::size_t, std::size_t)> progress_;
};

TEST_F(SessionSelectionTest, ThoseInTheMapComeFirstAndThenThoseThatAreStaged) {
  source_.Add({"a", "day"}, "staged", 2);
  source_.Add({"b", "day"}, "live", 3);
  source_.Add({"c", "day"}, "staged", 1);
  source_.Add({"d", "day"}, "released", 2);
  const ReadSessions read = MustRead();
  EXPECT_EQ(NamesOf(read.sessions), "b d a c ");
  ASSERT_EQ(read.sessions.size(), 4U);
  EXPECT_FALSE(read.sessions[1].is_staged);
  EXPECT_TRUE(read.sessions[2].is_staged);
  EXPECT_TRUE(read.left_out.empty());
  EXPECT_EQ(read.revision, 96U) << "the oldest that any of them was read at";
  ASSERT_EQ(read.readers.size(), 4U);
  EXPECT_EQ(*read.readers[2](1), source_.sessions[0].keyframes[1].blob);
  EXPECT_EQ(read.sessions[2].keyframes[1].sequence, 11U);
  EXPECT_EQ(read.sessions[2].keyframes[1].T_world_sensor.x_um, 1'000'000);
}

TEST_F(SessionSelectionTest, OfStagedOnesThoseThatAreWanted) {
  source_.Add({"a", "day"}, "staged", 2);
  source_.Add({"b", "day"}, "live", 2);
  source_.Add({"c", "day"}, "staged", 2);
  const ReadSessions read = MustRead({{"c", "day"}, {"b", "day"}});
  EXPECT_EQ(NamesOf(read.sessions), "b c ");
  EXPECT_EQ(WhyOf(read, "a"), "not asked for");
  const auto unknown = Read({{"a", "day"}, {"a", "night"}});
  ASSERT_FALSE(unknown.has_value());
  EXPECT_EQ(unknown.error(), Status(StatusCode::kNotFound, "there is no session a/night"));
}

TEST_F(SessionSelectionTest, WhatIsNoPartOfTheMapIsLeftOutAndListed) {
  source_.Add({"a", "day"}, "quarantined", 2);
  source_.Add({"b", "day"}, "retracted", 2);
  source_.Add({"c", "day"}, "staged", 0);
  source_.Add({"d", "day"}, "damaged", 2).summary.is_damaged = true;
  source_.sessions.back().summary.reason = "its row";
  const ReadSessions read = MustRead();
  EXPECT_TRUE(read.sessions.empty());
  EXPECT_EQ(read.revision, 0U) << "nothing was read";
  EXPECT_EQ(WhyOf(read, "a"), "quarantined");
  EXPECT_EQ(WhyOf(read, "b"), "retracted");
  EXPECT_EQ(WhyOf(read, "c"), "no keyframe");
  EXPECT_EQ(WhyOf(read, "d"), "damaged: its row");
}

TEST_F(SessionSelectionTest, KeyframesThatAreNotWholeAreLeftOutAndListed) {
  ListedSessions::Session& session = source_.Add({"a", "day"}, "staged", 5);
  session.keyframes[1].damage = "checksum";
  session.keyframes[1].blob.clear();
  session.keyframes[2].blob[session.keyframes[2].blob.size() / 2] ^= 0x01;  // nobody noticed
  session.keyframes[3].blob.clear();
  const ReadSessions read = MustRead();
  ASSERT_EQ(read.sessions.size(), 1U);
  ASSERT_EQ(read.sessions[0].keyframes.size(), 2U);
  EXPECT_EQ(read.sessions[0].keyframes[1].sequence, 14U);
  EXPECT_EQ(*read.readers[0](1), session.keyframes[4].blob);
  ASSERT_EQ(read.left_out.size(), 3U);
  EXPECT_EQ(read.left_out[0].why, "keyframe 11: checksum");
  EXPECT_EQ(read.left_out[1].why.substr(0, 13), "keyframe 12: ");
}

TEST_F(SessionSelectionTest, KeyframesOfAnotherProfileAreLeftOut) {
  MapProfile other;
  other.cell_size_um *= 2;
  ListedSessions::Session& session = source_.Add({"a", "day"}, "staged", 2);
  session.keyframes[0].blob = EncodeKeyframe(testing::BlankKeyframe(other, 4));
  const ReadSessions read = MustRead();
  ASSERT_EQ(read.sessions.size(), 1U);
  EXPECT_EQ(read.sessions[0].keyframes.size(), 1U);
  EXPECT_EQ(read.left_out.size(), 1U);
}

TEST_F(SessionSelectionTest, ASessionOfWhichNothingIsWholeIsNoSession) {
  source_.Add({"a", "day"}, "staged", 1).keyframes[0].damage = "checksum";
  const ReadSessions read = MustRead();
  EXPECT_TRUE(read.sessions.empty());
  ASSERT_EQ(read.left_out.size(), 2U);
  EXPECT_EQ(read.left_out[1].why, "no keyframe that is whole");
}

TEST_F(SessionSelectionTest, PositionsKnownFromElsewhereComeAlong) {
  ListedSessions::Session& session = source_.Add({"a", "day"}, "staged", 3);
  session.keyframes[0].prior = KnownPosition{1'500'000, -2'000'000, 3, 250};
  session.keyframes[1].prior = KnownPosition{1, 2, 3, 0};  // nobody knows how well
  const ReadSessions read = MustRead();
  const std::vector<MergeKeyframe>& keyframes = read.sessions.at(0).keyframes;
  ASSERT_TRUE(keyframes[0].prior.has_value());
  EXPECT_TRUE(keyframes[0].prior->p_world.isApprox(Eigen::Vector3d(1.5, -2.0, 3e-6)));
  EXPECT_EQ(keyframes[0].prior->radius_m, 0.25);
  EXPECT_FALSE(keyframes[1].prior.has_value());
  EXPECT_FALSE(keyframes[2].prior.has_value());
}

TEST_F(SessionSelectionTest, ProgressIsToldOfKeyframesAndMayEndIt) {
  source_.Add({"a", "day"}, "staged", 2);
  source_.Add({"b", "day"}, "live", 3).summary.keyframes = 1;  // two came meanwhile
  source_.Add({"c", "day"}, "retracted", 5);
  std::vector<std::size_t> told;
  progress_ = [&](std::size_t done, std::size_t all) {
    EXPECT_EQ(all, 3U);
    told.push_back(done);
    return Status();
  };
  MustRead();
  EXPECT_EQ(told, (std::vector<std::size_t>{1, 2, 3, 3, 3}));
  progress_ = [](std::size_t, std::size_t) {
    return Status(StatusCode::kUnavailable, "enough");
  };
  const auto read = Read();
  ASSERT_FALSE(read.has_value());
  EXPECT_EQ(read.error(), Status(StatusCode::kUnavailable, "enough"));
}

}  // namespace
}  // namespace atlas
