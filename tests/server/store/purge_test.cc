// Sessions that are deleted for good: what is left of them, in answers and in files.
#include <set>

#include "tests/server/store/purge_fixture.h"

namespace atlas {
namespace {

TEST_F(PurgeTest, NothingIsLeftButTheName) {
  Fill();
  ASSERT_TRUE(Update({{{Day(), 1}, PoseAt(700'000), {TileId{0, 5, 0}}}}).has_value());
  for (const TileClaim& claim : Claim().claims) {
    ASSERT_TRUE(Finish(claim, std::nullopt).has_value());
  }
  const auto purged = Change(SessionAction::kPurge);
  ASSERT_TRUE(purged.has_value()) << purged.error().message();
  EXPECT_TRUE(purged->is_changed);
  EXPECT_EQ(purged->state, SessionState::kPurged);
  EXPECT_EQ(purged->keyframes, kCount);
  EXPECT_EQ(purged->tiles_marked, 3U);
  std::set<TileId> marked;
  for (const TileClaim& claim : Claim().claims) {
    marked.insert(claim.id);
  }
  EXPECT_EQ(marked, (std::set<TileId>{{0, 0, 0}, {0, 1, 0}, {0, 5, 0}}));
  for (int reopened = 0; reopened < 2; ++reopened) {
    const SessionRecord day = store_->ListSessions({}, 1'000)->at(0);
    EXPECT_EQ(day.key, Day());
    EXPECT_EQ(day.state, SessionState::kPurged);
    EXPECT_EQ(day.reason, "asked for");
    EXPECT_EQ(day.keyframes + day.bytes + day.compacted + day.last_sequence, 0U);
    EXPECT_EQ(day.first_time_ms + day.last_time_ms, 0);
    const StoreCounts counts = store_->ReadCounts().value();
    EXPECT_EQ(counts.keyframes, kCount);
    EXPECT_EQ(counts.sessions, 2U);
    EXPECT_EQ(store_->FindKeyframes(std::vector<KeyframeKey>{{Day(), 1}}).error().code(),
              StatusCode::kNotFound);
    EXPECT_EQ(store_->GatherTile({0, 0, 0}, 0)->keyframes.size(), kCount / 2);
    EXPECT_TRUE(store_->ListKeyframesOfTile({0, 5, 0})->empty());
    ExpectSound();
    Open();
  }
  EXPECT_EQ(store_->ListEvents(0, 10)->back().kind, EventKind::kSessionPurged);
  EXPECT_EQ(store_->ListEvents(0, 10)->back().author, "tester");
}

TEST_F(PurgeTest, TheBytesAreGoneFromTheFiles) {
  Fill();
  EXPECT_GT(InTheFiles(Secret()), 1'000U);
  ASSERT_TRUE(Change(SessionAction::kPurge).has_value());
  EXPECT_TRUE(IsSoonGone(Secret())) << InTheFiles(Secret());
  EXPECT_GT(InTheFiles("of the night"), 1'000U);
  ASSERT_TRUE(Put(Large(9, "night", "later")).has_value());
  ExpectSound();
}

// Who reads keeps the log from being emptied; and so does a process that is gone.
TEST_F(PurgeTest, TheBytesAreGoneWhenNobodyReadsWhatWasBefore) {
  Fill();
  Reader reader(Database());
  ASSERT_TRUE(Change(SessionAction::kPurge).has_value());
  EXPECT_GT(InTheFiles(Secret()), 1'000U);
  EXPECT_TRUE(Put(Large(9, "night", "later")).has_value()) << "nobody waits for the reader";
  reader.Run("COMMIT");
  EXPECT_TRUE(IsSoonGone(Secret()));
}

TEST_F(PurgeTest, TheNextStartEmptiesALogThatAKilledProcessLeft) {
  Fill();
  Reader reader(Database());
  ASSERT_TRUE(Change(SessionAction::kPurge).has_value());
  store_.reset();  // the reader keeps the log where it is
  reader.Run("COMMIT");
  EXPECT_GT(InTheFiles(Secret()), 1'000U);
  Open();
  EXPECT_TRUE(IsSoonGone(Secret()));
}

TEST_F(PurgeTest, NobodyUploadsToItAgain) {
  Fill();
  ASSERT_TRUE(Change(SessionAction::kPurge).has_value());
  const std::uint64_t revision = Dirty().revision;
  for (const std::uint32_t sequence : {1U, 99U}) {
    const auto put = Put(Large(sequence));
    ASSERT_FALSE(put.has_value());
    EXPECT_EQ(put.error().code(), StatusCode::kConflict);
    EXPECT_NE(put.error().message().find("purged"), std::string::npos);
  }
  for (const auto action :
       {SessionAction::kRetract, SessionAction::kRestore, SessionAction::kRelease}) {
    EXPECT_EQ(Change(action).error().code(), StatusCode::kConflict);
  }
  EXPECT_FALSE(Change(SessionAction::kPurge)->is_changed);
  EXPECT_EQ(Change(SessionAction::kPurge, {"bus", "dusk"}).error().code(), StatusCode::kNotFound);
  EXPECT_EQ(Dirty().revision, revision);
  EXPECT_EQ(Change(SessionAction::kRetract, {"bus", ""})->sessions, 1U) << "the others";
}

TEST_F(PurgeTest, AVehicleOfWhichAllIsPurgedHasNoSession) {
  Fill();
  ASSERT_TRUE(Change(SessionAction::kPurge).has_value());
  ASSERT_TRUE(Change(SessionAction::kPurge, {"bus", "night"}).has_value());
  for (const auto action : {SessionAction::kRetract, SessionAction::kRestore}) {
    const auto changed = Change(action, {"bus", ""});
    ASSERT_FALSE(changed.has_value());
    EXPECT_EQ(changed.error().code(), StatusCode::kNotFound);
    EXPECT_NE(changed.error().message().find("vehicle bus has no session"), std::string::npos);
  }
}

TEST_F(PurgeTest, TheRevisionsBeforeCannotBeReadAnyMore) {
  Fill();
  const std::uint64_t before = Dirty().revision;
  const std::uint64_t purge = Change(SessionAction::kPurge)->revision;
  EXPECT_EQ(store_->CheckRevision(before).code(), StatusCode::kNotFound);
  EXPECT_EQ(store_->GatherTileAt({0, 0, 0}, before).error().code(), StatusCode::kNotFound);
  EXPECT_EQ(store_->GatherTileAt({0, 0, 0}, purge)->keyframes.size(), kCount / 2);
  EXPECT_TRUE(store_->GatherTile({0, 0, 0}, before)->is_whole) << "no row tells what left";
}

TEST_F(PurgeTest, FromAnyState) {
  for (const auto action :
       {SessionAction::kRetract, SessionAction::kRelease, SessionAction::kRestore}) {
    std::filesystem::remove_all(options_.directory);
    Fill();
    ASSERT_TRUE(Change(action).has_value());
    const auto purged = Change(SessionAction::kPurge);
    ASSERT_TRUE(purged.has_value()) << purged.error().message();
    EXPECT_EQ(purged->tiles_marked, action == SessionAction::kRetract ? 0U : 2U);
    ExpectSound();
    store_.reset();
  }
}

TEST_F(PurgeTest, WhatCompactionsDroppedOfItGoesToo) {
  Fill();
  ASSERT_TRUE(Await<CompactionResult>([&](auto done) {
                store_->Compact({Dirty().revision, 5'000, {1, 2, 3}, "tester"}, std::move(done));
              }).has_value());  // two of the day, one of the night
  ASSERT_TRUE(Change(SessionAction::kPurge).has_value());
  EXPECT_EQ(store_->ReadCounts()->compacted, 1U);
  ExpectSound();
  EXPECT_TRUE(Put(Large(1, "night", "of the night"))->is_duplicate);
}

TEST_F(PurgeTest, ADamagedRowThatTellsWhatToDeleteIsNamed) {
  Fill();
  Tamper("UPDATE keyframe_tiles SET revision = 77 WHERE keyframe_id = 1");
  Open();
  const auto refused = Change(SessionAction::kPurge);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code(), StatusCode::kInvalidData);
  EXPECT_EQ(store_->FindSession(Day()).value()->state, SessionState::kLive);
  EXPECT_EQ(store_->ReadCounts()->keyframes, 2 * kCount);
}

}  // namespace
}  // namespace atlas
