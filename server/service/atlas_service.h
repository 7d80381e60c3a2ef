// The use cases of the daemon over one store: what a request may do, independent of how it came.
// Thread-safe. Calls that wait take a deadline and a stop token, and end early with kUnavailable
// when the service stops.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "server/service/backup/backup_keeper.h"
#include "server/service/change_signal.h"
#include "server/service/compaction/automatic_compaction.h"
#include "server/service/fusion/fusion_scheduler.h"
#include "server/service/fusion_wait.h"
#include "server/service/history/past_atlas.h"
#include "server/service/log_sink.h"
#include "server/service/pose_requests.h"
#include "server/service/region/region_query.h"
#include "server/service/sync/sync_plan.h"
#include "server/service/upload_check.h"
#include "server/service/verification/scrubber.h"
#include "server/service/watch/watch_hub.h"
#include "server/service/whole_atlas.h"
#include "server/store/atlas_store.h"

namespace atlas {

struct ServiceStatus {
  StoreCounts counts;
  std::uint64_t damaged_tiles = 0;  // dirty, and damage keeps them from being fused
  std::uint64_t tiles_built = 0;    // of any level, since the service began
  double building_s = 0.0;          // that it took, all workers together
  std::uint64_t kept_bytes = 0;     // surveys kept for the next time, those that are compressed too
  std::uint64_t kept_disk_bytes = 0;  // and those on disk
  std::uint64_t rss_bytes = 0;
  ScrubFigures scrub;
  RoomFigures room;
};

// How much may be stored.
struct Retention {
  UploadLimits limits;
  bool is_compacting = false;  // by itself, when the store is nearly full
};

struct ServiceOptions {
  FusionOptions fusion;
  ScrubOptions scrub;
  BackupOptions backup;
  std::uint32_t sessions_per_hour = 1'000;  // that one vehicle may begin; 0: no limit
  PlausibilityLimits plausibility;          // sessions that break them are quarantined
  Retention retention;
  AutomaticCompactionOptions compaction;
  std::size_t past_cache_bytes = 128u << 20;  // all requests for earlier revisions together
  // Where the digest of an earlier revision sets tiles aside: a disk.
  std::filesystem::path scratch_directory = std::filesystem::temp_directory_path();
};

class AtlasService {
 public:
  AtlasService(AtlasStore& store, WallClock clock, LogSink log, const ServiceOptions& options);
  AtlasService(const AtlasService&) = delete;
  AtlasService& operator=(const AtlasService&) = delete;
  ~AtlasService();

  const StoreIdentity& identity() const { return store_.identity(); }
  std::int64_t NowMs() const { return clock_(); }  // since 1970

  // In two steps: the check takes its time, the other never blocks. `done` is called once it is on
  // disk, or refused.
  Result<NewKeyframe> CheckUpload(UploadRequest request) const;
  void PutKeyframe(NewKeyframe keyframe, AtlasStore::Done<PutKeyframeResult> done);
  // Both. Checked on the calling thread.
  void Upload(UploadRequest request, AtlasStore::Done<PutKeyframeResult> done);
  void UpdatePoses(PoseBatchRequest request, AtlasStore::Done<PoseBatchResult> done);
  void UndoPoses(PoseUndoRequest request, AtlasStore::Done<PoseBatchResult> done);
  void ChangeSession(SessionChange change, AtlasStore::Done<SessionChangeResult> done);
  // From now on.
  void set_sessions_per_hour(std::uint32_t sessions) { starts_->set_per_hour(sessions); }
  void SetRetention(const Retention& retention);
  // Of keyframes and changes from now on; a session stays what it is until then.
  void SetPlausibility(const PlausibilityLimits& limits);

  // fusion_wait.h
  Result<WaitOutcome> WaitUntilClean(const Patience& patience) {
    return wait_.UntilClean(patience);
  }
  Status WaitForRevision(std::uint64_t revision, const Patience& patience) {
    return wait_.ForRevision(revision, patience);
  }

  // A query of an earlier revision fuses what it sends: `patience` bounds all of it, kTimeout.
  Result<RegionQuery> Query(const RegionRequest& request,
                            RegionQuery::Options options,
                            const Patience& patience = {});
  // The query's next tile; one that turns out damaged is marked to be built again.
  Result<std::optional<StoredTile>> NextTile(RegionQuery& query);

  // What is to be sent (sync_plan.h), `max_items` of it; nullopt: that takes the disk or long, and
  // `may_block` is false.
  Result<std::optional<SyncPlan>> PlanSync(const SyncRequest& request,
                                           bool may_block,
                                           std::size_t max_items = SyncLimits().max_items);
  // Hears of every tile there that changes from now on. kInvalidArgument: levels that the atlas has
  // not.
  Result<std::shared_ptr<TileWatch>> Watch(TileWatch::Scope scope, std::function<void()> wake);
  // nullopt: there is no such tile. kInvalidData: it is damaged, and marked to be built again.
  Result<std::optional<StoredTile>> ReadTile(const TileId& id);

  Result<ServiceStatus> ReadStatus();
  // Behind `after`; atlas_store.h.
  Result<std::vector<SessionRecord>> ListSessions(const SessionKey& after, std::uint32_t limit) {
    return store_.ListSessions(after, limit);
  }
  Result<SessionPage> ListChangedSessions(const SessionKey& after, std::uint32_t limit) {
    return store_.ListChangedSessions(after, limit);
  }
  // Behind `after_sequence`; atlas_store.h. kUnavailable: a row is damaged.
  Result<KeyframePage> ListKeyframes(const SessionKey& session,
                                     std::optional<std::uint32_t> after_sequence,
                                     std::uint32_t limit);
  // The same with their blobs, as many as count for `max_bytes`; damaged ones say so. kUnavailable:
  // the session's row is damaged, or the index of its keyframes.
  Result<KeyframeContents> ReadKeyframes(const SessionKey& session,
                                         std::optional<std::uint32_t> after_sequence,
                                         std::size_t max_bytes);
  // nullopt: unknown. kUnavailable: its row is damaged.
  Result<std::optional<SessionRecord>> FindSession(const SessionKey& key);
  // Of the last change on disk; never blocks.
  std::uint64_t revision() const { return store_.revision(); }

  // whole_atlas.h
  Result<AtlasDigest> Digest(const Patience& patience) { return whole_.Digest(patience); }
  // What happened beside uploads, above `after_id`; atlas_store.h.
  Result<std::vector<Event>> ListEvents(std::uint64_t after_id, std::uint32_t limit) {
    return store_.ListEvents(after_id, limit);
  }
  Result<VerifyReport> Verify(const VerifyRequest& request, const Patience& patience) {
    return whole_.Verify(request, patience);
  }
  Result<CompactionReport> Compact(const CompactionRequest& request, const Patience& patience) {
    return whole_.Compact(request, patience);
  }
  // backup_keeper.h; `patience` bounds all of it, kTimeout, kUnavailable.
  Result<AtlasFacts> Backup(const BackupRequest& request,
                            const Patience& patience,
                            const std::function<void(const BackupProgress&)>& on_progress);
  Result<std::vector<StoredBackup>> ListBackups() const { return backups_.List(); }
  // Of the atlas as of an earlier revision, fused again; kTimeout if that takes longer.
  Result<AtlasDigest> DigestAt(std::uint64_t revision, const Patience& patience);

  // Ends every wait, verification and digest, now and from now on, with kUnavailable. The workers
  // go on, and uploads are still taken.
  void EndWaits() { changes_.Close(); }
  bool is_ending() const { return changes_.is_closed(); }
  // Returns when every upload and pose batch handed over before was reported to its `done`.
  void Flush() { store_.Flush(); }
  // EndWaits(), and the workers finish the tiles at hand, or leave what takes long, and end.
  void Stop();

 private:
  void LogJudgement(const SessionKey& session, const SessionJudgement& judgement) const;
  PlausibilityLimits plausibility() const;
  std::function<Status()> CheckPast(std::uint64_t revision, const Patience& patience) const;
  void RebuildDamaged(const TileId& id);
  void LogQuarantined(const PoseBatchResult& batch) const;
  AtlasStore::Done<PoseBatchResult> ReportingBatch(AtlasStore::Done<PoseBatchResult> done);

  AtlasStore& store_;
  WallClock clock_;
  LogSink log_;
  mutable std::mutex plausibility_mutex_;
  PlausibilityLimits plausibility_;
  const std::shared_ptr<SessionStarts> starts_;
  ChangeSignal changes_;
  WatchHub watches_;
  FusionScheduler fusion_;
  FusionWait wait_;
  WholeAtlas whole_;
  PastAtlas past_;
  Scrubber scrubber_;
  BackupKeeper backups_;
  AutomaticCompaction compaction_;
};

}  // namespace atlas
