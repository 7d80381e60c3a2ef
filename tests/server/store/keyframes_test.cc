// Uploads and pose updates: idempotent, all or nothing, and they mark what they touch.
#include <atomic>
#include <future>
#include <set>

#include "tests/server/store/store_fixture.h"

namespace atlas {
namespace {

using KeyframeStoreTest = StoreTest;

const TileId kA{0, 0, 0};
const TileId kB{0, 1, 0};
const TileId kC{0, 0, 1};

NewPose Moved(std::uint32_t sequence, std::int64_t x_um, std::vector<TileId> footprint) {
  NewPose pose;
  pose.key.session.vehicle = "bus";
  pose.key.session.session = "day";
  pose.key.sequence = sequence;
  pose.pose.x_um = x_um;
  pose.footprint = std::move(footprint);
  return pose;
}

std::set<TileId> Ids(const ClaimResult& result) {
  std::set<TileId> ids;
  for (const TileClaim& claim : result.claims) {
    ids.insert(claim.id);
  }
  return ids;
}

TEST_F(KeyframeStoreTest, UploadIsStoredAndMarksItsFootprint) {
  Open();
  const auto put = Put(MakeKeyframe(5, {kA, kB}));
  ASSERT_TRUE(put.has_value()) << put.error().message();
  EXPECT_FALSE(put->is_duplicate);
  EXPECT_EQ(put->tiles_marked, 2u);
  EXPECT_EQ(put->revision, 1u);
  EXPECT_EQ(Ids(Claim()), (std::set<TileId>{kA, kB}));
  const KeyframeKey key{{"bus", "day"}, 5};
  const auto found = store_->FindKeyframes(std::vector{key}).value();
  ASSERT_TRUE(found[0].has_value());
  EXPECT_EQ(found[0]->key, key);
  EXPECT_EQ(found[0]->time_ms, 1005);
  EXPECT_EQ(store_->ReadKeyframeBlob(found[0]->id).value(), (Bytes{7, 7, 5}));
}

TEST_F(KeyframeStoreTest, ResendIsADuplicateEvenAfterItsPoseWasCorrected) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA})).has_value());
  ASSERT_TRUE(Update({Moved(1, 5, {kB})}).has_value());
  const auto again = Put(MakeKeyframe(1, {kA}));
  ASSERT_TRUE(again.has_value());
  EXPECT_TRUE(again->is_duplicate);
  EXPECT_EQ(again->tiles_marked, 0u);
  EXPECT_EQ(again->revision, 2u);
  EXPECT_EQ(store_->ReadCounts()->keyframes, 1u);
}

TEST_F(KeyframeStoreTest, OtherContentUnderAKeyIsAConflict) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA})).has_value());
  NewKeyframe other_bytes = MakeKeyframe(1, {kA});
  other_bytes.blob = {9};
  EXPECT_EQ(Put(std::move(other_bytes)).error().code(), StatusCode::kConflict);
  NewKeyframe other_time = MakeKeyframe(1, {kA});
  other_time.time_ms += 1;
  EXPECT_EQ(Put(std::move(other_time)).error().code(), StatusCode::kConflict);
  EXPECT_EQ(store_->ReadCounts()->revision, 1u);
}

TEST_F(KeyframeStoreTest, PoseUpdateMarksOldAndNewFootprints) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA})).has_value());
  for (const TileClaim& claim : Claim().claims) {
    ASSERT_TRUE(Finish(claim, std::nullopt).has_value());
  }
  ASSERT_EQ(Dirty().dirty_tiles, 0u);
  const auto moved = Update({Moved(1, 5, {kB, kC})});
  ASSERT_TRUE(moved.has_value()) << moved.error().message();
  EXPECT_EQ(moved->updated, 1u);
  EXPECT_EQ(moved->tiles_marked, 3u);
  EXPECT_EQ(moved->batch, 1u);
  EXPECT_EQ(Ids(Claim()), (std::set<TileId>{kA, kB, kC}));
  EXPECT_TRUE(store_->GatherTile(kA, 0)->keyframes.empty());
  const auto sources = store_->GatherTile(kC, 0).value();
  ASSERT_EQ(sources.keyframes.size(), 1u);
  EXPECT_EQ(sources.keyframes[0].pose, PoseAt(5));
  EXPECT_EQ(sources.revision, 2u);
}

TEST_F(KeyframeStoreTest, AnEqualPoseChangesNothing) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA})).has_value());
  const auto same = Update({Moved(1, 0, {kA})});
  ASSERT_TRUE(same.has_value());
  EXPECT_EQ(same->updated, 0u);
  EXPECT_EQ(same->tiles_marked, 0u);
  EXPECT_EQ(same->revision, 1u);
}

TEST_F(KeyframeStoreTest, PoseBatchIsAllOrNothing) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA})).has_value());
  const auto refused = Update({Moved(1, 5, {kB}), Moved(99, 5, {kB})});
  EXPECT_EQ(refused.error().code(), StatusCode::kNotFound);
  EXPECT_NE(refused.error().message().find("bus/day/99"), std::string::npos);
  EXPECT_EQ(store_->GatherTile(kA, 0)->keyframes[0].pose, PoseAt(0));
  EXPECT_EQ(Ids(Claim()), std::set<TileId>{kA});
  EXPECT_EQ(store_->ReadCounts()->revision, 1u);
}

TEST_F(KeyframeStoreTest, TheSameKeyframeTwiceInABatchIsRefused) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA})).has_value());
  const NewPose pose = Moved(1, 5, {kB});
  EXPECT_EQ(Update({pose, pose}).error().code(), StatusCode::kInvalidData);
}

TEST_F(KeyframeStoreTest, SessionsAndCountsFollowUploads) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(3, {kA})).has_value());
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA})).has_value());
  NewKeyframe other = MakeKeyframe(8, {kB});
  other.key.session.session = "night";
  ASSERT_TRUE(Put(std::move(other)).has_value());
  const auto sessions = store_->ListSessions({}, 1'000).value();
  ASSERT_EQ(sessions.size(), 2u);
  EXPECT_EQ(sessions[0].keyframes, 2u);
  EXPECT_EQ(sessions[0].bytes, 6u);
  EXPECT_EQ(sessions[0].first_time_ms, 1001);
  EXPECT_EQ(sessions[0].last_time_ms, 1003);
  EXPECT_EQ(sessions[0].last_sequence, 3u);
  const StoreCounts counts = store_->ReadCounts().value();
  EXPECT_EQ(counts.sessions, 2u);
  EXPECT_EQ(counts.keyframes, 3u);
  EXPECT_EQ(counts.keyframe_bytes, 9u);
  EXPECT_EQ(counts.dirty_tiles, 2u);
  EXPECT_GT(counts.store_bytes, 0u);
}

TEST_F(KeyframeStoreTest, ARefusedUploadLeavesNoSession) {
  Open();
  // Two writes in one group: the second conflicts and takes nothing of the first with it.
  NewKeyframe conflicting = MakeKeyframe(1, {kB});
  conflicting.blob = {1};
  std::promise<void> both;
  std::atomic<int> left = 2;
  std::vector<Status> results(2);
  const auto on_done = [&](std::size_t i) {
    return [&, i](const Result<PutKeyframeResult>& result) {
      results[i] = result ? Status() : result.error();
      if (--left == 0) {
        both.set_value();
      }
    };
  };
  store_->PutKeyframe(MakeKeyframe(1, {kA}), on_done(0));
  store_->PutKeyframe(std::move(conflicting), on_done(1));
  both.get_future().wait();
  EXPECT_TRUE(results[0].ok());
  EXPECT_EQ(results[1].code(), StatusCode::kConflict);
  EXPECT_EQ(Ids(Claim()), std::set<TileId>{kA});
  EXPECT_EQ(store_->ReadCounts()->keyframes, 1u);
}

}  // namespace
}  // namespace atlas
