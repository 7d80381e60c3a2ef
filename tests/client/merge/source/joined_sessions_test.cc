// Several sources read as the one that they would become.
#include "client/merge/source/joined_sessions.h"

#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "client/merge/source/session_selection.h"
#include "tests/client/merge/source/listed_sessions.h"

namespace atlas {
namespace {

using testing::ListedSessions;

class JoinedSessionsTest : public ::testing::Test {
 protected:
  JoinedSessionsTest() {
    for (int i = 0; i < 3; ++i) sources_.push_back(std::make_unique<ListedSessions>());
  }

  ListedSessions& Of(std::size_t source) {
    return *static_cast<ListedSessions*>(sources_[source].get());
  }

  JoinedSessions Join() {
    auto joined = JoinedSessions::Make(std::move(sources_));
    EXPECT_TRUE(joined.has_value());
    return *std::move(joined);
  }
  static std::string StatesOf(JoinedSessions& joined) {
    std::string states;
    const std::vector<SessionSummary> sessions = joined.ListSessions().value();
    for (const SessionSummary& session : sessions) {
      states += session.key.vehicle + "=" + session.state + " ";
    }
    return states;
  }
  static std::vector<std::uint32_t> NumbersOf(JoinedSessions& joined, const SessionKey& key) {
    std::vector<std::uint32_t> numbers;
    const auto reading = joined.ReadKeyframes(key, [&](SessionKeyframe keyframe) -> Status {
      numbers.push_back(keyframe.sequence);
      return {};
    });
    EXPECT_TRUE(reading.has_value()) << reading.error().message();
    return numbers;
  }

  std::vector<std::unique_ptr<SessionSource>> sources_;
};

TEST_F(JoinedSessionsTest, WhatOthersHaveInTheirMapsWouldBeStaged) {
  Of(0).Add({"a", "day"}, "live", 2);
  Of(0).Add({"b", "day"}, "retracted", 2);
  Of(1).Add({"c", "day"}, "live", 2);
  Of(1).Add({"d", "day"}, "staged", 2);
  Of(2).Add({"e", "day"}, "released", 2);
  Of(2).Add({"f", "day"}, "quarantined", 2);
  JoinedSessions joined = Join();
  EXPECT_EQ(StatesOf(joined), "a=live b=retracted c=staged d=staged e=staged f=quarantined ");
}

// As a daemon has it that an interrupted run brought half of a session to.
TEST_F(JoinedSessionsTest, ASessionOfSeveralIsReadOnceAndInTheStateThatTheFirstHasItIn) {
  Of(0).Add({"a", "day"}, "live", 2);
  Of(1).Add({"a", "day"}, "staged", 4);
  Of(2).Add({"a", "day"}, "retracted", 6);  // is not brought
  JoinedSessions joined = Join();
  EXPECT_EQ(StatesOf(joined), "a=live ");
  EXPECT_EQ(NumbersOf(joined, {"a", "day"}), (std::vector<std::uint32_t>{10, 11, 12, 13}));
}

// They come behind the first one's; a merge needs them by their numbers.
TEST_F(JoinedSessionsTest, AMergeReadsThemInOrder) {
  auto& first = Of(0).Add({"a", "day"}, "staged", 4);
  first.keyframes.erase(first.keyframes.begin() + 1);
  auto& second = Of(1).Add({"a", "day"}, "staged", 2);
  Keyframe other = testing::BlankKeyframe(MapProfile(), 4);
  other.sensor_height_mm += 7;
  const Bytes missing = EncodeKeyframe(other);
  second.keyframes[1].blob = missing;
  JoinedSessions joined = Join();
  EXPECT_EQ(StatesOf(joined), "a=staged ");
  EXPECT_EQ(NumbersOf(joined, {"a", "day"}), (std::vector<std::uint32_t>{10, 12, 13, 11}));
  KeyframeSpool spool = *KeyframeSpool::Create();
  const auto read = ReadForMerge(joined, {}, spool, nullptr);
  ASSERT_TRUE(read.has_value()) << read.error().message();
  ASSERT_EQ(read->sessions.size(), 1U);
  const auto& keyframes = read->sessions[0].keyframes;
  ASSERT_EQ(keyframes.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(keyframes[i].sequence, 10 + i);
  EXPECT_EQ(*read->readers[0](1), missing);
}

TEST_F(JoinedSessionsTest, TheRevisionIsTheFirstOnesAlone) {
  Of(0).Add({"a", "day"}, "live", 2);
  Of(1).Add({"b", "day"}, "live", 2);
  JoinedSessions joined = Join();
  ASSERT_TRUE(joined.ListSessions().has_value());
  const auto ignore = [](SessionKeyframe) {
    return Status();
  };
  EXPECT_GT(joined.ReadKeyframes({"a", "day"}, ignore)->revision, 0U);
  EXPECT_EQ(joined.ReadKeyframes({"b", "day"}, ignore)->revision, 0U);
  KeyframeSpool spool = *KeyframeSpool::Create();
  const auto read = ReadForMerge(joined, {}, spool, nullptr);
  ASSERT_TRUE(read.has_value());
  EXPECT_GT(read->revision, 0U) << "what is of another atlas has none here";
}

TEST_F(JoinedSessionsTest, TwoKeyframesOfOneNumberAreAConflict) {
  Of(0).Add({"a", "day"}, "staged", 2);
  Of(1).Add({"a", "day"}, "staged", 2).keyframes[1].blob[5] ^= 0x01;
  Of(0).list_name = "monday.db";
  Of(1).list_name = "tuesday.db";
  JoinedSessions joined = Join();
  ASSERT_TRUE(joined.ListSessions().has_value());
  const auto reading = joined.ReadKeyframes({"a", "day"}, [](SessionKeyframe) { return Status(); });
  ASSERT_FALSE(reading.has_value());
  EXPECT_EQ(reading.error().code(), StatusCode::kConflict);
  for (const char* const said : {"session a/day", "monday.db", "tuesday.db", "retract a/day"}) {
    EXPECT_NE(reading.error().message().find(said), std::string::npos) << reading.error().message();
  }
}

TEST_F(JoinedSessionsTest, ADamagedOneIsTakenFromWhoHasItWhole) {
  auto& damaged = Of(0).Add({"a", "day"}, "staged", 2).keyframes[1];
  damaged.damage = "checksum";
  damaged.blob.clear();
  Of(1).Add({"a", "day"}, "staged", 2);
  JoinedSessions joined = Join();
  KeyframeSpool spool = *KeyframeSpool::Create();
  const auto read = ReadForMerge(joined, {}, spool, nullptr);
  ASSERT_TRUE(read.has_value());
  ASSERT_EQ(read->sessions.size(), 1U);
  EXPECT_EQ(read->sessions[0].keyframes.size(), 2U);
  ASSERT_EQ(read->left_out.size(), 1U);
  EXPECT_EQ(read->left_out[0].why, "keyframe 11: checksum");
}

TEST_F(JoinedSessionsTest, WhatNobodyHasIsNotFound) {
  JoinedSessions joined = Join();
  EXPECT_EQ(StatesOf(joined), "");
  const auto reading = joined.ReadKeyframes({"a", "day"}, [](SessionKeyframe) { return Status(); });
  ASSERT_FALSE(reading.has_value());
  EXPECT_EQ(reading.error().code(), StatusCode::kNotFound);
}

TEST_F(JoinedSessionsTest, AllHaveOneMapProfile) {
  Of(2).map_profile.cell_size_um *= 2;
  const auto joined = JoinedSessions::Make(std::move(sources_));
  ASSERT_FALSE(joined.has_value());
  EXPECT_EQ(joined.error().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace atlas
