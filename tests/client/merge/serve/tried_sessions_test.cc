#include "client/merge/serve/tried_sessions.h"

#include <gtest/gtest.h>

namespace atlas {
namespace {

using Keys = std::vector<SessionKey>;

const SessionKey kMap{"map", "day"};
const SessionKey kA{"a", "day"};
const SessionKey kB{"b", "day"};

KnownSession InMap(std::uint64_t revision, bool is_closed = true) {
  return {false, true, is_closed, revision};
}
KnownSession Staged(std::uint64_t revision, bool is_closed = true) {
  return {true, false, is_closed, revision};
}
KnownSession Retracted(std::uint64_t revision) {
  return {false, false, true, revision};
}

TEST(TriedSessionsTest, ClosedStagedSessionsAreTriedOnce) {
  TriedSessions tried;
  KnownSessions known{{kMap, InMap(5)}, {kA, Staged(7)}, {kB, Staged(9, false)}};
  EXPECT_EQ(tried.WorthTrying(known), Keys{kA}) << "the other one is uploaded to";
  tried.MetNobody(kA, known, {10, 0});
  EXPECT_EQ(tried.WorthTrying(known), Keys{});
  known[kB] = Staged(9);
  EXPECT_EQ(tried.WorthTrying(known), (Keys{kA, kB})) << "they might meet";
  tried.MetNobody(kA, known, {12, 0});
  tried.MetNobody(kB, known, {12, 0});
  EXPECT_EQ(tried.WorthTrying(known), Keys{});
}

TEST(TriedSessionsTest, WhoMetNobodyIsTriedAgainWhenSomethingCameOrChanged) {
  TriedSessions tried;
  const KnownSessions before{{kMap, InMap(5)}, {kA, Staged(7)}};
  tried.MetNobody(kA, before, {10, 0});
  const auto is_tried_with = [&](const SessionKey& key, const KnownSession& session) {
    KnownSessions known = before;
    known[key] = session;
    return tried.WorthTrying(known) == Keys{kA};
  };
  EXPECT_FALSE(is_tried_with(kMap, InMap(10))) << "as it was read";
  EXPECT_TRUE(is_tried_with(kMap, InMap(11))) << "corrected since";
  EXPECT_FALSE(is_tried_with(kMap, InMap(11, false))) << "it grows: when that has ended";
  EXPECT_TRUE(is_tried_with(kA, Staged(11))) << "it has changed itself";
  EXPECT_TRUE(is_tried_with(kB, InMap(11)));
  EXPECT_FALSE(is_tried_with(kB, InMap(11, false)));
  EXPECT_FALSE(is_tried_with(kB, Retracted(11))) << "it is not merged with";
  EXPECT_FALSE(is_tried_with(kMap, Retracted(11)));
}

TEST(TriedSessionsTest, WhatItsOwnMergeDidToOthersIsNothingNew) {
  TriedSessions tried;
  KnownSessions known{{kMap, InMap(5)}, {kA, Staged(7)}, {kB, Staged(8)}};
  tried.MetNobody(kA, known, {10, 12});  // which published b and moved the map
  known[kMap] = InMap(12);
  known[kB] = InMap(12);
  EXPECT_EQ(tried.WorthTrying(known), Keys{});
  known[kMap] = InMap(11);  // before the batch, and after it was read
  EXPECT_EQ(tried.WorthTrying(known), Keys{kA});
  known[kMap] = InMap(13);
  EXPECT_EQ(tried.WorthTrying(known), Keys{kA});
}

TEST(TriedSessionsTest, WhoWasSetAsideIsTriedWhenWhatItIsAboutChanges) {
  TriedSessions tried;
  const KnownSessions before{{kMap, InMap(5)}, {kA, Staged(7)}, {kB, InMap(6)}};
  tried.SetAside(kA, before, {kMap});
  EXPECT_EQ(tried.WorthTrying(before), Keys{});
  KnownSessions known = before;
  known[kB] = InMap(20);
  EXPECT_EQ(tried.WorthTrying(known), Keys{}) << "it is about another one";
  known[kMap] = InMap(21, false);
  EXPECT_EQ(tried.WorthTrying(known), Keys{}) << "it grows: when that has ended";
  known[kMap] = InMap(21);
  EXPECT_EQ(tried.WorthTrying(known), Keys{kA});
  known[kMap] = Retracted(22);
  EXPECT_EQ(tried.WorthTrying(known), Keys{kA});
  known.erase(kMap);
  EXPECT_EQ(tried.WorthTrying(known), Keys{kA});
  known = before;
  known[kA] = Staged(8);
  EXPECT_EQ(tried.WorthTrying(known), Keys{kA});
}

TEST(TriedSessionsTest, WhoWasSetAsideDoesNotComeAlong) {
  TriedSessions tried;
  KnownSessions known{{kMap, InMap(5)}, {kA, Staged(7)}};
  tried.SetAside(kA, known, {kMap});
  known[kB] = Staged(9);
  EXPECT_EQ(tried.WorthTrying(known), Keys{kB});
}

TEST(TriedSessionsTest, WhoWasRefusedIsTriedWhenItOrTheMapIsAnother) {
  TriedSessions tried;
  const KnownSessions before{{kMap, InMap(5)}, {kA, Staged(7)}};
  tried.Refused(kA, before);
  KnownSessions known = before;
  known[kMap] = InMap(20);
  EXPECT_EQ(tried.WorthTrying(known), Keys{}) << "merges move it";
  known[kB] = Staged(9);
  EXPECT_EQ(tried.WorthTrying(known), Keys{kB}) << "it does not come along";
  known[kA] = Staged(21);
  EXPECT_EQ(tried.WorthTrying(known), (Keys{kA, kB}));
  known = before;
  known[kMap] = Retracted(22);
  EXPECT_EQ(tried.WorthTrying(known), Keys{kA}) << "it may have been that one";
  known.erase(kMap);
  EXPECT_EQ(tried.WorthTrying(known), Keys{kA});
}

// Else a staged session would become a map of its own beside it.
TEST(TriedSessionsTest, AMapThatGrowsIsWaitedForUnlessPartOfItIsClosed) {
  const TriedSessions tried;
  KnownSessions known{{kMap, InMap(5, false)}, {kA, Staged(7)}};
  EXPECT_EQ(tried.WorthTrying(known), Keys{});
  known[kB] = InMap(6);
  EXPECT_EQ(tried.WorthTrying(known), Keys{kA});
  known.erase(kMap);
  known.erase(kB);
  EXPECT_EQ(tried.WorthTrying(known), Keys{kA}) << "it begins the map";
}

TEST(TriedSessionsTest, WhatIsGoneIsForgotten) {
  TriedSessions tried;
  const KnownSessions known{{kMap, InMap(5)}, {kA, Staged(7)}};
  tried.SetAside(kA, known, {});
  tried.ForgetOthers(known);
  EXPECT_EQ(tried.WorthTrying(known), Keys{});
  tried.ForgetOthers({{kMap, InMap(5)}});
  EXPECT_EQ(tried.WorthTrying(known), Keys{kA});
}

}  // namespace
}  // namespace atlas
