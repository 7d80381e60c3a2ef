// A store with some sessions, and batches of corrections with a condition or of what they publish.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tests/server/store/store_fixture.h"

namespace atlas {

class PoseBatchTest : public StoreTest {
 protected:
  static constexpr PlausibilityLimits kLimits{90.0, 50.0, 15.0, 10.0};
  static inline const SessionKey kDay{"bus", "day"};
  static inline const SessionKey kNight{"bus", "night"};
  static TileId Tile(std::int64_t x_m) { return {0, static_cast<std::int32_t>(x_m), 0}; }

  // Keyframe `sequence` of a session, `x_m` along a line of tiles of a metre each.
  PutKeyframeResult PutAt(const SessionKey& session,
                          std::uint32_t sequence,
                          std::int64_t x_m,
                          bool is_staged = false) {
    NewKeyframe keyframe = MakeKeyframe(sequence, {Tile(x_m)});
    keyframe.key.session = session;
    keyframe.time_ms = 100 * std::int64_t{sequence};
    keyframe.pose = PoseAt(x_m * 1'000'000);
    keyframe.limits = kLimits;
    keyframe.is_staged = is_staged;
    const auto put = Put(std::move(keyframe));
    EXPECT_TRUE(put.has_value()) << put.error().message();
    return put.value_or(PutKeyframeResult());
  }
  // `bus/day` live, `bus/night` staged, three keyframes each.
  void Fill() {
    Open();
    for (std::uint32_t i = 1; i <= 3; ++i) {
      PutAt(kDay, i, i);
      PutAt(kNight, i, 10 + i, true);
    }
  }
  static NewPose To(const SessionKey& session, std::uint32_t sequence, std::int64_t x_m) {
    return {{session, sequence}, PoseAt(x_m * 1'000'000), {Tile(x_m)}};
  }
  Result<PoseBatchResult> Apply(std::vector<NewPose> poses,
                                std::vector<SessionKey> published = {},
                                std::uint64_t if_revision = 0) {
    return Await<PoseBatchResult>([&](auto done) {
      store_->UpdatePoses({std::move(poses), "merge", if_revision, std::move(published), kLimits},
                          std::move(done));
    });
  }
  // As the service does: what is read is handed back, with the tiles of each pose.
  Result<PoseBatchResult> Undo(std::uint64_t batch) {
    const auto changed = store_->ReadBatchToUndo(batch);
    if (!changed) {
      return Error(changed.error());
    }
    PoseUndo undo{batch, {}, "alice", kLimits};
    for (const auto& [keyframe, before] : changed->keyframes) {
      undo.poses.push_back({keyframe.key, before, {Tile(before.x_um / 1'000'000)}});
    }
    return Await<PoseBatchResult>(
        [&](auto done) { store_->UndoPoses(std::move(undo), std::move(done)); });
  }
  Result<SessionChangeResult> Change(SessionAction action, const SessionKey& key) {
    return Await<SessionChangeResult>([&](auto done) {
      store_->ChangeSession({key, action, "tester", "", kLimits}, std::move(done));
    });
  }
  SessionState StateOf(const SessionKey& key) { return store_->FindSession(key).value()->state; }
  // What the atlas is made of: of each tile on the line, the keyframes and where they are.
  std::map<std::string, std::int64_t> Map() {
    std::map<std::string, std::int64_t> keyframes;
    for (std::int64_t x_m = 0; x_m < 100; ++x_m) {
      const auto sources = store_->GatherTile(Tile(x_m), 0).value();
      for (const KeyframeRecord& record : sources.keyframes) {
        keyframes[record.key.session.session + std::to_string(record.key.sequence) + "@" +
                  std::to_string(x_m)] = record.pose.x_um;
      }
    }
    return keyframes;
  }
  std::vector<std::string> Events() {
    std::vector<std::string> lines;
    const auto events = store_->ListEvents(0, 1'000).value();
    for (const Event& event : events) {
      lines.push_back(std::string(EventName(event.kind)) + " by " + event.author + " of " +
                      event.subject + ": " + event.detail);
    }
    return lines;
  }
  void ExpectSound() {
    for (const SessionKey& key : {kDay, kNight}) {
      const Status session = store_->CheckSession(key);
      EXPECT_TRUE(session.ok()) << session.message();
    }
    const Status counters = store_->CheckCounters();
    EXPECT_TRUE(counters.ok()) << counters.message();
    const Status indexes = store_->CheckIndexes([] { return Status(); });
    EXPECT_TRUE(indexes.ok()) << indexes.message();
    const auto ids = store_->ListKeyframeIds(0, 1'000).value();
    for (const std::int64_t id : ids) {
      const auto read = store_->ReadKeyframe(id);
      EXPECT_TRUE(read.has_value()) << read.error().message();
    }
  }
};

}  // namespace atlas
