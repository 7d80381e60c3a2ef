// Sessions that are kept and not in the map until somebody publishes them.
#include <string>
#include <vector>

#include "tests/server/store/store_fixture.h"

namespace atlas {
namespace {

const TileId kA{0, 0, 0};
const TileId kB{0, 1, 0};
const SessionKey kDay{"bus", "day"};
constexpr PlausibilityLimits kLimits{90.0, 50.0, 15.0, 10.0};

class StagedTest : public StoreTest {
 protected:
  static NewKeyframe At(std::uint32_t sequence, std::int64_t x_m, bool is_staged = true) {
    NewKeyframe keyframe = MakeKeyframe(sequence, {sequence % 2 == 0 ? kA : kB});
    keyframe.time_ms = 100 * std::int64_t{sequence};
    keyframe.pose = PoseAt(x_m * 1'000'000);
    keyframe.limits = kLimits;
    keyframe.is_staged = is_staged;
    return keyframe;
  }
  PutKeyframeResult PutAt(std::uint32_t sequence, std::int64_t x_m, bool is_staged = true) {
    const auto put = Put(At(sequence, x_m, is_staged));
    EXPECT_TRUE(put.has_value()) << put.error().message();
    return put.value_or(PutKeyframeResult());
  }
  Result<SessionChangeResult> Change(SessionAction action, const SessionKey& key = kDay) {
    return Await<SessionChangeResult>([&](auto done) {
      store_->ChangeSession({key, action, "tester", "why not", kLimits}, std::move(done));
    });
  }
  StatusCode ChangeCode(SessionAction action) {
    const auto changed = Change(action);
    return changed ? StatusCode::kOk : changed.error().code();
  }
  SessionState State() { return store_->FindSession(kDay).value()->state; }
  std::size_t InTheMap() {
    return store_->GatherTile(kA, 0)->keyframes.size() +
           store_->GatherTile(kB, 0)->keyframes.size();
  }
  std::vector<std::string> Events() {
    std::vector<std::string> lines;
    const auto events = store_->ListEvents(0, 1'000).value();
    for (const Event& event : events) {
      lines.push_back(std::string(EventName(event.kind)) + " by " + event.author);
    }
    return lines;
  }
  void ExpectSound() {
    const Status session = store_->CheckSession(kDay);
    EXPECT_TRUE(session.ok()) << session.message();
    const Status counters = store_->CheckCounters();
    EXPECT_TRUE(counters.ok()) << counters.message();
    const Status indexes = store_->CheckIndexes([] { return Status(); });
    EXPECT_TRUE(indexes.ok()) << indexes.message();
  }
};

TEST_F(StagedTest, AStagedSessionIsKeptAndMarksNothing) {
  Open();
  for (std::uint32_t i = 1; i <= 3; ++i) {
    const PutKeyframeResult put = PutAt(i, i);
    EXPECT_FALSE(put.is_duplicate);
    EXPECT_EQ(put.tiles_marked, 0U);
    EXPECT_FALSE(put.judgement.has_value());
  }
  EXPECT_TRUE(Put(At(2, 2))->is_duplicate);
  EXPECT_EQ(State(), SessionState::kStaged);
  EXPECT_EQ(InTheMap(), 0U);
  EXPECT_EQ(Dirty().dirty_tiles, 0U);
  EXPECT_EQ(store_->ReadCounts()->keyframes, 3U);
  Open();
  EXPECT_EQ(State(), SessionState::kStaged) << "after a restart";
  ExpectSound();
}

TEST_F(StagedTest, WhoBeginsASessionSaysWhetherItIsStaged) {
  Open();
  PutAt(1, 1);
  PutAt(2, 2, false);
  EXPECT_EQ(State(), SessionState::kStaged);
  ASSERT_TRUE(Change(SessionAction::kPublish).has_value());
  EXPECT_EQ(PutAt(3, 3).tiles_marked, 1U) << "published by then";
  EXPECT_EQ(State(), SessionState::kLive);
  EXPECT_EQ(InTheMap(), 3U);
}

TEST_F(StagedTest, PublishingPutsItIntoTheMapOnce) {
  Open();
  PutAt(1, 1);
  const std::uint64_t before = PutAt(2, 2).revision;
  const auto published = Change(SessionAction::kPublish);
  ASSERT_TRUE(published.has_value()) << published.error().message();
  EXPECT_TRUE(published->is_changed);
  EXPECT_EQ(published->state, SessionState::kLive);
  EXPECT_EQ(published->tiles_marked, 2U);
  EXPECT_EQ(InTheMap(), 2U);
  EXPECT_EQ(store_->GatherTileAt(kA, before)->keyframes.size(), 0U) << "not at that revision";
  const auto again = Change(SessionAction::kPublish);
  EXPECT_FALSE(again->is_changed);
  EXPECT_EQ(again->tiles_marked, 0U);
  EXPECT_EQ(again->revision, published->revision);
  EXPECT_EQ(Events(), std::vector<std::string>{"session_published by tester"});
  ExpectSound();
}

TEST_F(StagedTest, WhatLooksWrongIsQuarantinedWhenItIsPublished) {
  Open();
  PutAt(1, 1);
  PutAt(2, 5'000);
  EXPECT_EQ(State(), SessionState::kStaged) << "nobody judges what is not in the map";
  const auto published = Change(SessionAction::kPublish);
  EXPECT_TRUE(published->is_changed);
  EXPECT_EQ(published->state, SessionState::kQuarantined);
  EXPECT_EQ(published->tiles_marked, 0U);
  EXPECT_EQ(InTheMap(), 0U);
  EXPECT_EQ(Events(), (std::vector<std::string>{"session_published by tester",
                                                "session_quarantined by atlasd"}));
  EXPECT_FALSE(Change(SessionAction::kPublish)->is_changed);
  EXPECT_EQ(State(), SessionState::kQuarantined);
  ASSERT_TRUE(Change(SessionAction::kRelease).has_value());
  EXPECT_EQ(InTheMap(), 2U);
}

TEST_F(StagedTest, RestoredItIsStagedAgain) {
  Open();
  PutAt(1, 1);
  ASSERT_TRUE(Change(SessionAction::kRetract).has_value());
  EXPECT_EQ(ChangeCode(SessionAction::kPublish), StatusCode::kConflict);
  PutAt(2, 5'000);
  EXPECT_EQ(State(), SessionState::kRetracted);
  EXPECT_EQ(Change(SessionAction::kRestore)->state, SessionState::kStaged);
  ASSERT_TRUE(Change(SessionAction::kRetract, {"bus", ""}).has_value());
  EXPECT_EQ(Change(SessionAction::kRestore, {"bus", ""})->state, SessionState::kStaged);
  EXPECT_EQ(InTheMap(), 0U);
  ExpectSound();
}

TEST_F(StagedTest, APublishedSessionThatIsRetractedComesBackIntoTheMap) {
  Open();
  PutAt(1, 1);
  ASSERT_TRUE(Change(SessionAction::kPublish).has_value());
  ASSERT_TRUE(Change(SessionAction::kRetract).has_value());
  EXPECT_EQ(Change(SessionAction::kRestore)->state, SessionState::kLive);
  EXPECT_EQ(InTheMap(), 1U);
}

TEST_F(StagedTest, OnlyQuarantineIsReleased) {
  Open();
  PutAt(1, 1);
  EXPECT_EQ(ChangeCode(SessionAction::kRelease), StatusCode::kConflict);
  EXPECT_EQ(State(), SessionState::kStaged);
}

TEST_F(StagedTest, PublishingLeavesOtherStatesAsTheyAre) {
  Open();
  PutAt(1, 1, false);
  EXPECT_FALSE(Change(SessionAction::kPublish)->is_changed);
  EXPECT_EQ(State(), SessionState::kLive);
  ASSERT_TRUE(Change(SessionAction::kRelease).has_value());
  EXPECT_EQ(Change(SessionAction::kPublish)->state, SessionState::kReleased);
  ASSERT_TRUE(Change(SessionAction::kPurge).has_value());
  EXPECT_EQ(ChangeCode(SessionAction::kPublish), StatusCode::kConflict);
  EXPECT_EQ(Change(SessionAction::kPublish, {"bus", "dusk"}).error().code(), StatusCode::kNotFound);
}

TEST_F(StagedTest, PurgedItIsGoneAndNothingIsFusedAgain) {
  Open();
  PutAt(1, 1);
  const auto purged = Change(SessionAction::kPurge);
  EXPECT_EQ(purged->keyframes, 1U);
  EXPECT_EQ(purged->tiles_marked, 0U);
  EXPECT_EQ(store_->ReadCounts()->keyframes, 0U);
  EXPECT_EQ(Put(At(1, 1)).error().code(), StatusCode::kConflict);
  ExpectSound();
}

TEST_F(StagedTest, CorrectedPosesMarkNothingAndCountOncePublished) {
  Open();
  PutAt(1, 1);
  const auto moved = Update({{{kDay, 1}, PoseAt(7'000'000), {kA}}});
  ASSERT_TRUE(moved.has_value()) << moved.error().message();
  EXPECT_EQ(moved->updated, 1U);
  EXPECT_EQ(moved->tiles_marked, 0U);
  ASSERT_TRUE(Change(SessionAction::kPublish).has_value());
  const auto sources = store_->GatherTile(kA, 0).value();
  ASSERT_EQ(sources.keyframes.size(), 1U);
  EXPECT_EQ(sources.keyframes[0].pose.x_um, 7'000'000);
  EXPECT_EQ(store_->GatherTile(kB, 0)->keyframes.size(), 0U);
}

TEST_F(StagedTest, ADamagedRowIsStagedAgain) {
  Open();
  PutAt(1, 1);
  Tamper("UPDATE sessions SET state = 1");
  Open();
  EXPECT_EQ(State(), SessionState::kStaged) << "its history says what it was";
  EXPECT_EQ(InTheMap(), 0U);
  ExpectSound();
}

TEST_F(StagedTest, WithoutItsHistoryItStaysStaged) {
  Open();
  PutAt(1, 1);
  Tamper("UPDATE session_states SET reason = 'x'");
  Open();
  EXPECT_FALSE(store_->CheckSession(kDay).ok());
  const auto repaired = Await<std::uint32_t>(
      [&](auto done) { store_->RepairTables(TableRepair::kRows, "tester", std::move(done)); });
  ASSERT_TRUE(repaired.has_value()) << repaired.error().message();
  EXPECT_EQ(State(), SessionState::kStaged);
  ASSERT_TRUE(Change(SessionAction::kRetract).has_value());
  EXPECT_EQ(Change(SessionAction::kRestore)->state, SessionState::kStaged);
  ExpectSound();
}

TEST_F(StagedTest, KeyframesAreListedPageByPage) {
  Open();
  EXPECT_EQ(store_->ListKeyframes(kDay, std::nullopt, 2).error().code(), StatusCode::kNotFound);
  for (const std::uint32_t i : {0U, 2U, 7U}) {
    PutAt(i, i);
  }
  ASSERT_TRUE(Update({{{kDay, 7}, PoseAt(70'000'000), {kA}}}).has_value());
  const auto first = store_->ListKeyframes(kDay, std::nullopt, 2).value();
  ASSERT_EQ(first.keyframes.size(), 2U);
  EXPECT_TRUE(first.has_more);
  EXPECT_EQ(first.keyframes[0].key.sequence, 0U);
  EXPECT_EQ(first.keyframes[1].key.sequence, 2U);
  const auto rest = store_->ListKeyframes(kDay, 2, 2).value();
  ASSERT_EQ(rest.keyframes.size(), 1U);
  EXPECT_FALSE(rest.has_more);
  EXPECT_EQ(rest.keyframes[0].pose.x_um, 70'000'000) << "as it is now";
  EXPECT_EQ(rest.keyframes[0].time_ms, 700);
  EXPECT_EQ(store_->ListKeyframes(kDay, 0, 2)->keyframes.size(), 2U) << "0 is behind none yet";
  EXPECT_TRUE(store_->ListKeyframes(kDay, 0xffffffff, 2)->keyframes.empty());
}

}  // namespace
}  // namespace atlas
