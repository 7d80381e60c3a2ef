#include "server/service/atlas_service.h"

#include <algorithm>
#include <chrono>
#include <stop_token>
#include <utility>

#include "core/base/str_cat.h"
#include "server/service/process_memory.h"
#include "server/service/region/current_tiles.h"
#include "server/store/await.h"

namespace atlas {
namespace {

// Of automatic compaction: for what is there to be fused, and the step.
constexpr std::chrono::hours kStepPatience{1};

// Calls `done` with the result after waking whoever waits for changes.
template <typename T>
AtlasStore::Done<T> Notifying(ChangeSignal& changes, AtlasStore::Done<T> done) {
  return [&changes, done = std::move(done)](Result<T> result) {
    changes.Notify();
    done(std::move(result));
  };
}

// Damage here is no fault of what a vehicle sends: it keeps that, and tries again.
Status OfTheStore(const Status& damage) {
  return {StatusCode::kUnavailable,
          StrCat("the atlas is damaged, an operator has to look (atlas verify --repair): ",
                 damage.message())};
}

}  // namespace

AtlasService::AtlasService(AtlasStore& store,
                           WallClock clock,
                           LogSink log,
                           const ServiceOptions& options)
    : store_(store),
      clock_(std::move(clock)),
      log_(std::move(log)),
      plausibility_(options.plausibility),
      starts_(std::make_shared<SessionStarts>(options.sessions_per_hour)),
      fusion_(
          store,
          changes_,
          clock_,
          log_,
          [this](const TileId& id, std::uint64_t revision) { watches_.Publish(id, revision); },
          options.fusion),
      wait_(store, changes_, fusion_),
      whole_(store, changes_, wait_),
      past_(store, options.past_cache_bytes, options.scratch_directory),
      scrubber_(store, changes_, log_, options.scrub),
      backups_(store, log_, options.backup),
      compaction_(
          store,
          [this](const CompactionRequest& request, const std::stop_token& stop) {
            return whole_.Compact(request, Patience(kStepPatience, stop));
          },
          log_,
          options.compaction) {
  SetRetention(options.retention);
}

AtlasService::~AtlasService() {
  Stop();
  Flush();  // queued writes report to this
}

void AtlasService::Stop() {
  EndWaits();
  compaction_.Stop();
  scrubber_.Stop();
  fusion_.Stop();
}

Result<NewKeyframe> AtlasService::CheckUpload(UploadRequest request) const {
  return atlas::CheckUpload(std::move(request), identity().profile, clock_());
}

void AtlasService::PutKeyframe(NewKeyframe keyframe, AtlasStore::Done<PutKeyframeResult> done) {
  keyframe.start = std::make_shared<SessionStart>(starts_);
  keyframe.limits = plausibility();
  const auto report = [this, session = keyframe.key.session,
                       done = std::move(done)](Result<PutKeyframeResult> result) {
    if (result && result->judgement) {
      LogJudgement(session, *result->judgement);
    }
    if (!result && result.error().code() == StatusCode::kInvalidData) {
      result = Error(OfTheStore(result.error()));
    }
    done(std::move(result));
  };
  store_.PutKeyframe(std::move(keyframe), Notifying<PutKeyframeResult>(changes_, report));
}

Result<KeyframePage> AtlasService::ListKeyframes(const SessionKey& session,
                                                 std::optional<std::uint32_t> after_sequence,
                                                 std::uint32_t limit) {
  auto page = store_.ListKeyframes(session, after_sequence, limit);
  if (!page && page.error().code() == StatusCode::kInvalidData) {
    return Error(OfTheStore(page.error()));
  }
  return page;
}

Result<KeyframeContents> AtlasService::ReadKeyframes(const SessionKey& session,
                                                     std::optional<std::uint32_t> after_sequence,
                                                     std::size_t max_bytes) {
  auto contents = store_.ReadKeyframes(session, after_sequence, max_bytes);
  if (!contents && contents.error().code() == StatusCode::kInvalidData) {
    return Error(OfTheStore(contents.error()));
  }
  return contents;
}

Result<std::optional<SessionRecord>> AtlasService::FindSession(const SessionKey& key) {
  auto found = store_.FindSession(key);
  if (!found && found.error().code() == StatusCode::kInvalidData) {
    return Error(OfTheStore(found.error()));
  }
  return found;
}

void AtlasService::LogJudgement(const SessionKey& session,
                                const SessionJudgement& judgement) const {
  if (judgement.state == SessionState::kQuarantined) {
    log_(LogLevel::kWarning,
         StrCat("session ", session, " is quarantined, its keyframes are not in the map: ",
                judgement.reason, "; atlas session release, retract or purge"));
  } else {
    log_(LogLevel::kInfo,
         StrCat("session ", session, " is plausible again, its keyframes are in the map"));
  }
}

void AtlasService::Upload(UploadRequest request, AtlasStore::Done<PutKeyframeResult> done) {
  auto keyframe = CheckUpload(std::move(request));
  if (!keyframe) {
    done(Error(keyframe.error()));
    return;
  }
  PutKeyframe(*std::move(keyframe), std::move(done));
}

// Of sessions that looked wrong when they were published.
void AtlasService::LogQuarantined(const PoseBatchResult& batch) const {
  for (const auto& [session, entered] : batch.sessions) {
    if (entered.state == SessionState::kQuarantined) {
      LogJudgement(session, entered);
    }
  }
}

AtlasStore::Done<PoseBatchResult> AtlasService::ReportingBatch(
    AtlasStore::Done<PoseBatchResult> done) {
  const auto report = [this, done = std::move(done)](Result<PoseBatchResult> result) {
    if (result) {
      LogQuarantined(*result);
    }
    done(std::move(result));
  };
  return Notifying<PoseBatchResult>(changes_, report);
}

void AtlasService::UpdatePoses(PoseBatchRequest request, AtlasStore::Done<PoseBatchResult> done) {
  auto batch = PlacePoses(store_, std::move(request));
  if (!batch) {
    done(Error(batch.error()));
    return;
  }
  batch->limits = plausibility();
  store_.UpdatePoses(std::move(*batch), ReportingBatch(std::move(done)));
}

void AtlasService::UndoPoses(PoseUndoRequest request, AtlasStore::Done<PoseBatchResult> done) {
  auto undo = PlaceUndo(store_, std::move(request));
  if (!undo) {
    done(Error(undo.error()));
    return;
  }
  undo->limits = plausibility();
  store_.UndoPoses(*std::move(undo), ReportingBatch(std::move(done)));
}

void AtlasService::ChangeSession(SessionChange change, AtlasStore::Done<SessionChangeResult> done) {
  Status status = CheckSessionChange(change);
  if (!status.ok()) {
    done(Error(std::move(status)));
    return;
  }
  change.limits = plausibility();
  store_.ChangeSession(std::move(change), Notifying(changes_, std::move(done)));
}

std::function<Status()> AtlasService::CheckPast(std::uint64_t revision,
                                                const Patience& patience) const {
  return wait_.Check(patience,
                     StrCat("the atlas of revision ", revision, " was not fused in time"));
}

Result<RegionQuery> AtlasService::Query(const RegionRequest& request,
                                        RegionQuery::Options options,
                                        const Patience& patience) {
  if (!request.at_revision) {
    return RegionQuery::Create(std::make_shared<CurrentTiles>(store_), request, std::move(options));
  }
  auto view = past_.View(request, CheckPast(*request.at_revision, patience));
  if (!view) {
    return Error(view.error());
  }
  return RegionQuery::Create(std::move(*view), request, std::move(options));
}

Result<std::optional<StoredTile>> AtlasService::NextTile(RegionQuery& query) {
  auto tile = query.Next();
  const bool is_damaged = !tile && tile.error().code() == StatusCode::kInvalidData;
  if (is_damaged && !query.is_of_the_past() && query.last_tried()) {
    RebuildDamaged(*query.last_tried());
  }
  return tile;
}

Result<std::optional<SyncPlan>> AtlasService::PlanSync(const SyncRequest& request,
                                                       bool may_block,
                                                       std::size_t max_items) {
  SyncLimits limits;
  limits.max_items = max_items;
  return atlas::PlanSync(request, store_, store_.identity().profile, may_block, limits);
}

Result<std::shared_ptr<TileWatch>> AtlasService::Watch(TileWatch::Scope scope,
                                                       std::function<void()> wake) {
  const std::uint32_t top = identity().profile.levels - 1u;
  scope.coarsest_level = scope.coarsest_level == 0 ? top : std::min(scope.coarsest_level, top);
  if (scope.finest_level > scope.coarsest_level) {
    return Error(StatusCode::kInvalidArgument,
                 StrCat("watch: finest level ", scope.finest_level,
                        ", expected 0 to the coarsest, ", scope.coarsest_level));
  }
  return watches_.Open(std::move(scope), std::move(wake));
}

Result<std::optional<StoredTile>> AtlasService::ReadTile(const TileId& id) {
  auto tile = store_.ReadTile(id);
  if (!tile && tile.error().code() == StatusCode::kInvalidData) {
    RebuildDamaged(id);
  }
  return tile;
}

void AtlasService::RebuildDamaged(const TileId& id) {
  log_(LogLevel::kError, StrCat("tile ", id, " is damaged and will be built again"));
  const auto marked =
      Await<std::uint32_t>([&](auto done) { store_.MarkDirty({id}, std::move(done)); });
  if (!marked) {
    log_(LogLevel::kError, marked.error().message());
  }
  changes_.Notify();
}

Result<ServiceStatus> AtlasService::ReadStatus() {
  auto counts = store_.ReadCounts();
  if (!counts) {
    return Error(counts.error());
  }
  return ServiceStatus{*counts,
                       fusion_.damage().size(),
                       fusion_.tiles_built(),
                       fusion_.building_s(),
                       fusion_.kept_bytes(),
                       fusion_.kept_disk_bytes(),
                       ResidentBytes(),
                       scrubber_.figures(),
                       store_.ReadRoom()};
}

// Of another preset every keyframe counts: whoever expects room is told at once.
void AtlasService::SetRetention(const Retention& retention) {
  store_.SetUploadLimits(retention.limits);
  const FusionPreset preset = identity().profile.preset;
  const bool can_compact = preset == FusionPreset::kBounded;
  if (retention.is_compacting && !can_compact) {
    log_(LogLevel::kWarning, StrCat("retention.compact has no effect: this atlas has preset ",
                                    FusionPresetName(preset), ", in which every keyframe counts"));
  }
  compaction_.set_on(retention.is_compacting && can_compact);
}

void AtlasService::SetPlausibility(const PlausibilityLimits& limits) {
  const std::lock_guard lock(plausibility_mutex_);
  plausibility_ = limits;
}

PlausibilityLimits AtlasService::plausibility() const {
  const std::lock_guard lock(plausibility_mutex_);
  return plausibility_;
}

Result<AtlasFacts> AtlasService::Backup(
    const BackupRequest& request,
    const Patience& patience,
    const std::function<void(const BackupProgress&)>& on_progress) {
  BackupWork work;
  work.check_stop = wait_.Check(patience, "the backup was not written in time");
  work.on_progress = on_progress;
  return backups_.Write(request, std::move(work));
}

Result<AtlasDigest> AtlasService::DigestAt(std::uint64_t revision, const Patience& patience) {
  return past_.Digest(revision, CheckPast(revision, patience));
}

}  // namespace atlas
