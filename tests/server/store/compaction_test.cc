// Keyframes dropped for good: what stays of them, who is told what, and what damage to it looks
// like.
#include <algorithm>
#include <array>
#include <csignal>

#include <sys/wait.h>
#include <unistd.h>

#include "tests/server/store/store_fixture.h"

namespace atlas {
namespace {

const TileId kA{0, 0, 0};
const TileId kB{0, 1, 0};

class CompactionTest : public StoreTest {
 protected:
  Result<CompactionResult> Compact(std::vector<std::int64_t> ids,
                                   std::optional<std::uint64_t> at_revision = std::nullopt) {
    Compaction compaction{at_revision.value_or(Dirty().revision), 5'000, std::move(ids), "tester"};
    return Await<CompactionResult>(
        [&](auto done) { store_->Compact(std::move(compaction), std::move(done)); });
  }
  static NewPose Moved(std::uint32_t sequence, std::int64_t x_um, std::vector<TileId> footprint) {
    return {{{"bus", "day"}, sequence}, PoseAt(x_um), std::move(footprint)};
  }
  // Keyframes 1, 2 and 3 of a session, with ids as their sequence numbers; revision 3.
  void OpenWithThree() {
    Open();
    ASSERT_TRUE(Put(MakeKeyframe(1, {kA, kB})).has_value());
    ASSERT_TRUE(Put(MakeKeyframe(2, {kA})).has_value());
    ASSERT_TRUE(Put(MakeKeyframe(3, {kA})).has_value());
  }
  void ExpectAsWithThree() {
    EXPECT_EQ(Dirty().revision, 3u);
    EXPECT_EQ(store_->ReadCounts()->keyframes, 3u);
    EXPECT_EQ(store_->ReadCounts()->compacted, 0u);
    EXPECT_EQ(store_->GatherTile(kA, 0)->keyframes.size(), 3u);
    EXPECT_TRUE(store_->ReadKeyframeBlob(1).has_value());
    EXPECT_TRUE(store_->CheckRevision(0).ok());
  }
};

TEST_F(CompactionTest, WhatIsDroppedIsGoneAndCounted) {
  OpenWithThree();
  ASSERT_TRUE(Update({Moved(1, 7, {kB})}).has_value());
  const auto done = Compact({1, 3});
  ASSERT_TRUE(done.has_value()) << done.error().message();
  EXPECT_EQ(done->dropped, 2u);
  EXPECT_EQ(done->bytes, 6u);
  EXPECT_EQ(done->revision, 5u);
  EXPECT_EQ(done->horizon, 5u);
  for (int reopened = 0; reopened < 2; ++reopened) {
    const StoreCounts counts = store_->ReadCounts().value();
    EXPECT_EQ(counts.revision, 5u);
    EXPECT_EQ(counts.keyframes, 1u);
    EXPECT_EQ(counts.keyframe_bytes, 3u);
    EXPECT_EQ(counts.compacted, 2u);
    const SessionRecord session = store_->ListSessions({}, 1'000)->at(0);
    EXPECT_EQ(session.keyframes, 1u);
    EXPECT_EQ(session.bytes, 3u);
    EXPECT_EQ(session.compacted, 2u);
    EXPECT_EQ(session.state, SessionState::kLive);
    EXPECT_EQ(session.first_time_ms, 1001);
    EXPECT_EQ(session.last_time_ms, 1003);
    EXPECT_EQ(store_->ListKeyframeIds(0, 10).value(), std::vector<std::int64_t>{2});
    EXPECT_EQ(store_->GatherTile(kA, 0)->keyframes.size(), 1u);
    EXPECT_EQ(store_->ListFootprintTiles(0, -1, 10).value(), std::vector<TileId>{kA});
    EXPECT_EQ(store_->ReadKeyframeBlob(1).error().code(), StatusCode::kInvalidData);
    EXPECT_TRUE(store_->CheckSession(session.key).ok());
    EXPECT_TRUE(store_->CheckCompactions().ok());
    Open();
  }
}

TEST_F(CompactionTest, WithoutKeyframesNothingIsWritten) {
  OpenWithThree();
  const auto done = Compact({});
  ASSERT_TRUE(done.has_value());
  EXPECT_EQ(done->dropped, 0u);
  EXPECT_EQ(done->revision, 3u);
  EXPECT_EQ(done->horizon, 0u);
  ExpectAsWithThree();
  Compact({1}).value();
  EXPECT_EQ(Compact({})->horizon, 4u);
  EXPECT_EQ(Dirty().revision, 4u);
}

TEST_F(CompactionTest, OnlyTilesThatStoodStillAreCompacted) {
  OpenWithThree();
  for (const std::uint64_t other : {0u, 2u, 4u}) {
    EXPECT_EQ(Compact({1}, other).error().code(), StatusCode::kConflict);
  }
  EXPECT_EQ(Compact({}, 4).error().code(), StatusCode::kConflict);
  EXPECT_EQ(Compact({1, 9}).error().code(), StatusCode::kInvalidData);
  EXPECT_EQ(Compact({1, 1}).error().code(), StatusCode::kInvalidData);
  ExpectAsWithThree();
  EXPECT_TRUE(Compact({1}, 3).has_value());
  EXPECT_EQ(Compact({2}, 3).error().code(), StatusCode::kConflict) << "compacted since";
}

TEST_F(CompactionTest, WhatChangesElsewhereDoesNotHoldItUp) {
  OpenWithThree();
  ASSERT_TRUE(Put(MakeKeyframe(4, {kB, TileId{0, 9, 9}})).has_value());
  EXPECT_EQ(Compact({1}, 3).error().code(), StatusCode::kConflict) << "both touch a tile";
  const auto done = Compact({2}, 3);
  ASSERT_TRUE(done.has_value()) << done.error().message();
  EXPECT_EQ(done->revision, 5u);
  EXPECT_EQ(store_->ReadCounts()->keyframes, 3u);
}

TEST_F(CompactionTest, ACorrectionSinceIsAChange) {
  OpenWithThree();
  ASSERT_TRUE(Update({Moved(3, 7, {TileId{0, 5, 5}})}).has_value());
  EXPECT_EQ(Compact({1}, 3).error().code(), StatusCode::kConflict);
  EXPECT_TRUE(Compact({1}, 4).has_value());
}

TEST_F(CompactionTest, ADroppedKeyframeIsStillKnownToItsSender) {
  OpenWithThree();
  Compact({1}).value();
  for (int reopened = 0; reopened < 2; ++reopened) {
    const auto again = Put(MakeKeyframe(1, {kA, kB}));
    ASSERT_TRUE(again.has_value()) << again.error().message();
    EXPECT_TRUE(again->is_duplicate);
    EXPECT_EQ(again->tiles_marked, 0u);
    NewKeyframe other = MakeKeyframe(1, {kA});
    other.blob.back() = 99;
    EXPECT_EQ(Put(other).error().code(), StatusCode::kConflict);
    other = MakeKeyframe(1, {kA});
    other.time_ms += 1;
    EXPECT_EQ(Put(other).error().code(), StatusCode::kConflict);
    EXPECT_EQ(store_->ReadCounts()->revision, 4u);
    EXPECT_EQ(store_->ReadCounts()->keyframes, 2u);
    Open();
  }
}

TEST_F(CompactionTest, APoseOfADroppedKeyframeIsTakenAndChangesNothing) {
  OpenWithThree();
  Compact({1}).value();
  const DirtyState before = Dirty();
  const auto found =
      store_->FindKeyframes(std::vector<KeyframeKey>{{{"bus", "day"}, 1}, {{"bus", "day"}, 2}});
  ASSERT_TRUE(found.has_value());
  EXPECT_FALSE(found->at(0).has_value());
  EXPECT_EQ(found->at(1)->id, 2);
  const auto alone = Update({Moved(1, 7, {kB})});
  ASSERT_TRUE(alone.has_value());
  EXPECT_EQ(alone->updated, 0u);
  EXPECT_EQ(alone->compacted, 1u);
  EXPECT_EQ(alone->batch, 0u);
  EXPECT_EQ(Dirty().revision, before.revision);
  const auto both = Update({Moved(1, 7, {kB}), Moved(2, 7, {kA})});
  ASSERT_TRUE(both.has_value());
  EXPECT_EQ(both->updated, 1u);
  EXPECT_EQ(both->compacted, 1u);
  EXPECT_EQ(both->tiles_marked, 1u);
  EXPECT_EQ(Update({Moved(1, 7, {kB}), Moved(9, 7, {kA})}).error().code(), StatusCode::kNotFound);
  EXPECT_EQ(Update({Moved(1, 7, {}), Moved(1, 7, {})}).error().code(), StatusCode::kInvalidData);
  EXPECT_EQ(store_->ListFootprintTiles(0, -1, 10).value(), std::vector<TileId>{kA});
}

TEST_F(CompactionTest, NothingBeforeItCanBeRead) {
  OpenWithThree();
  EXPECT_TRUE(store_->CheckRevision(0).ok());
  Compact({1}).value();
  EXPECT_EQ(store_->CheckRevision(3).code(), StatusCode::kNotFound);
  EXPECT_EQ(store_->GatherTileAt(kA, 3).error().code(), StatusCode::kNotFound);
  EXPECT_EQ(store_->GatherTileAt(kA, 4)->keyframes.size(), 2u);
  ASSERT_TRUE(Put(MakeKeyframe(4, {kB})).has_value());
  EXPECT_TRUE(store_->CheckRevision(4).ok());
}

TEST_F(CompactionTest, WhoAskedBeforeItIsToldEverything) {
  OpenWithThree();
  EXPECT_TRUE(store_->GatherTile(kA, 0)->is_whole);
  EXPECT_FALSE(store_->GatherTile(kA, 2)->is_whole);
  EXPECT_EQ(store_->GatherTile(kA, 2)->keyframes.size(), 1u);
  Compact({1}).value();
  const TileSources whole = store_->GatherTile(kA, 3).value();
  EXPECT_TRUE(whole.is_whole);
  EXPECT_EQ(whole.keyframes.size(), 2u);
  const TileSources changes = store_->GatherTile(kA, 4).value();
  EXPECT_FALSE(changes.is_whole);
  EXPECT_TRUE(changes.keyframes.empty());
}

TEST_F(CompactionTest, ASessionThatLostAllGoesOn) {
  OpenWithThree();
  Compact({1, 2, 3}).value();
  EXPECT_EQ(store_->ListSessions({}, 1'000)->at(0).keyframes, 0u);
  EXPECT_EQ(store_->ReadCounts()->sessions, 1u);
  EXPECT_TRUE(Put(MakeKeyframe(2, {kA}))->is_duplicate);
  ASSERT_TRUE(Put(MakeKeyframe(4, {kA})).has_value());
  EXPECT_EQ(store_->ListSessions({}, 1'000)->at(0).keyframes, 1u);
  EXPECT_EQ(store_->ListSessions({}, 1'000)->at(0).compacted, 3u);
  EXPECT_EQ(store_->ListSessions({}, 1'000)->at(0).first_time_ms, 1001);
  EXPECT_EQ(store_->ListKeyframeIds(0, 10).value(), std::vector<std::int64_t>{4});  // no id twice
  EXPECT_TRUE(store_->CheckSession({"bus", "day"}).ok());
  const auto retracted = Await<SessionChangeResult>([&](auto done) {
    store_->ChangeSession({{"bus", "day"}, SessionAction::kRetract, "tester", ""}, std::move(done));
  });
  EXPECT_EQ(retracted->tiles_marked, 1u);
}

TEST_F(CompactionTest, DamageToWhatIsLeftIsFound) {
  const std::vector<std::string> damages = {
      "UPDATE tombstones SET blob_hash = blob_hash + 1",
      "UPDATE tombstones SET compaction_id = 2",
      "DELETE FROM tombstones WHERE sequence = 1",
      "UPDATE compactions SET dropped = 3",
      "UPDATE compactions SET author = ''",
  };
  for (const std::string& damage : damages) {
    SCOPED_TRACE(damage);
    std::filesystem::remove_all(options_.directory);
    OpenWithThree();
    Compact({1, 2}).value();
    Tamper(damage);
    Open();
    const std::array<Status, 3> found{
        store_->CheckSession({"bus", "day"}), store_->CheckCompactions(),
        store_->ListSessions({}, 1'000) ? Status() : store_->ListSessions({}, 1'000).error()};
    EXPECT_TRUE(std::any_of(found.begin(), found.end(), [](const Status& status) {
      return status.code() == StatusCode::kInvalidData;
    }));
    store_.reset();
  }
}

TEST_F(CompactionTest, AnAcknowledgedOneSurvivesAKilledProcess) {
  std::array<int, 2> pipe_ends{};
  ASSERT_EQ(::pipe(pipe_ends.data()), 0);
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    OpenWithThree();
    const char ok = Compact({1}).has_value() ? 1 : 0;
    [[maybe_unused]] const auto written = ::write(pipe_ends[1], &ok, 1);
    ::pause();
  }
  ::close(pipe_ends[1]);  // so that the read below ends when the child does
  char ok = 0;
  ASSERT_EQ(::read(pipe_ends[0], &ok, 1), 1);
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  ::close(pipe_ends[0]);
  ASSERT_EQ(ok, 1);
  Open();
  EXPECT_EQ(store_->ReadCounts()->keyframes, 2u);
  EXPECT_EQ(store_->ReadCounts()->compacted, 1u);
  EXPECT_TRUE(store_->CheckCompactions().ok());
}

}  // namespace
}  // namespace atlas
