#include "client/merge/serve/settled_sessions.h"

#include <gtest/gtest.h>

namespace atlas {
namespace {

using std::chrono::seconds;

const SettledSessions::Clock::time_point kStart{};

SessionSummary Staged(const std::string& session, std::uint64_t keyframes) {
  SessionSummary summary;
  summary.key = {"car", session};
  summary.state = "staged";
  summary.keyframes = keyframes;
  return summary;
}

TEST(SettledSessionsTest, ASessionSettlesWhenListsShowItAlikeForSoLong) {
  SettledSessions sessions(seconds(10));
  EXPECT_TRUE(sessions.Settled(kStart).empty());
  sessions.Look({Staged("a", 5), Staged("b", 7)}, kStart);
  EXPECT_TRUE(sessions.Settled(kStart + seconds(9)).empty());
  sessions.Look({Staged("a", 6), Staged("b", 7)}, kStart + seconds(9));
  const auto settled = sessions.Settled(kStart + seconds(10));
  ASSERT_EQ(settled.size(), 1U);
  EXPECT_EQ(settled.begin()->first.session, "b");
  EXPECT_EQ(settled.begin()->second.keyframes, 7U);
  EXPECT_TRUE(settled.begin()->second.IsStaged());
  EXPECT_EQ(sessions.Settled(kStart + seconds(19)).size(), 2U) << "no other list is needed";
}

TEST(SettledSessionsTest, WhateverAListTellsUnsettles) {
  const auto is_settled_after = [](auto change) {
    SettledSessions sessions(seconds(10));
    SessionSummary session = Staged("a", 5);
    sessions.Look({session}, kStart);
    change(session);
    sessions.Look({session}, kStart + seconds(11));
    return !sessions.Settled(kStart + seconds(11)).empty();
  };
  EXPECT_TRUE(is_settled_after([](SessionSummary&) {}));
  EXPECT_FALSE(is_settled_after([](SessionSummary& s) { s.state = "live"; }));
  EXPECT_FALSE(is_settled_after([](SessionSummary& s) { ++s.bytes; }));
  EXPECT_FALSE(is_settled_after([](SessionSummary& s) { ++s.last_sequence; }));
  EXPECT_FALSE(is_settled_after([](SessionSummary& s) { ++s.compacted; }));
  EXPECT_FALSE(is_settled_after([](SessionSummary& s) { s.is_damaged = true; }));
}

TEST(SettledSessionsTest, OneThatWentAndCameBackSettlesAnew) {
  SettledSessions sessions(seconds(10));
  sessions.Look({Staged("a", 5)}, kStart);
  sessions.Look({}, kStart + seconds(20));
  EXPECT_TRUE(sessions.Settled(kStart + seconds(20)).empty());
  sessions.Look({Staged("a", 5)}, kStart + seconds(21));
  EXPECT_TRUE(sessions.Settled(kStart + seconds(30)).empty());
  EXPECT_EQ(sessions.Settled(kStart + seconds(31)).size(), 1U);
}

TEST(SettledSessionsTest, OnlyAWholeSessionWithKeyframesIsMerged) {
  EXPECT_TRUE(MarkOf(Staged("a", 1)).IsStaged());
  EXPECT_FALSE(MarkOf(Staged("a", 0)).IsStaged());
  SessionSummary other = Staged("a", 1);
  other.is_damaged = true;
  EXPECT_FALSE(MarkOf(other).IsStaged());
  for (const char* const state : {"retracted", "quarantined", "purged", "live", "released"}) {
    other = Staged("a", 1);
    other.state = state;
    EXPECT_FALSE(MarkOf(other).IsStaged()) << state;
    EXPECT_EQ(MarkOf(other).IsInMap(), other.IsInMap()) << state;
  }
}

}  // namespace
}  // namespace atlas
