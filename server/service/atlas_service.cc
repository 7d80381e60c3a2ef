#include "server/service/atlas_service.h"

#include <algorithm>
#include <utility>

#include "core/base/str_cat.h"
#include "server/service/process_memory.h"
#include "server/service/region/current_tiles.h"
#include "server/store/await.h"

namespace atlas {
namespace {

std::chrono::steady_clock::time_point DeadlineOf(const Patience& patience) {
  return std::chrono::steady_clock::now() + patience.timeout;
}

// What is found between two uploads is looked for again so often.
constexpr int kCompactionAttempts = 3;

bool IsClean(const DirtyState& state) {
  return state.dirty_tiles == 0;
}

// Calls `done` with the result after waking whoever waits for changes.
template <typename T>
AtlasStore::Done<T> Notifying(ChangeSignal& changes, AtlasStore::Done<T> done) {
  return [&changes, done = std::move(done)](Result<T> result) {
    changes.Notify();
    done(std::move(result));
  };
}

}  // namespace

AtlasService::AtlasService(AtlasStore& store,
                           WallClock clock,
                           LogSink log,
                           const ServiceOptions& options)
    : store_(store),
      clock_(std::move(clock)),
      log_(std::move(log)),
      options_(options),
      fusion_(
          store,
          changes_,
          clock_,
          log_,
          [this](const TileId& id, std::uint64_t revision) { watches_.Publish(id, revision); },
          options.fusion),
      past_(store, options.past_cache_bytes, options.scratch_directory) {}

AtlasService::~AtlasService() {
  Stop();
  Flush();  // queued writes report to this
}

void AtlasService::Stop() {
  EndWaits();
  fusion_.Stop();
}

Result<NewKeyframe> AtlasService::CheckUpload(UploadRequest request) const {
  return atlas::CheckUpload(std::move(request), identity().profile, clock_());
}

void AtlasService::PutKeyframe(NewKeyframe keyframe, AtlasStore::Done<PutKeyframeResult> done) {
  store_.PutKeyframe(std::move(keyframe), Notifying(changes_, std::move(done)));
}

void AtlasService::Upload(UploadRequest request, AtlasStore::Done<PutKeyframeResult> done) {
  auto keyframe = CheckUpload(std::move(request));
  if (!keyframe) {
    done(Error(keyframe.error()));
    return;
  }
  PutKeyframe(*std::move(keyframe), std::move(done));
}

void AtlasService::UpdatePoses(PoseBatchRequest request, AtlasStore::Done<PoseBatchResult> done) {
  auto batch = PlacePoses(std::move(request));
  if (!batch) {
    done(Error(batch.error()));
    return;
  }
  store_.UpdatePoses(std::move(*batch), Notifying(changes_, std::move(done)));
}

void AtlasService::ChangeSession(SessionChange change, AtlasStore::Done<SessionChangeResult> done) {
  Status status = CheckSessionChange(change);
  if (!status.ok()) {
    done(Error(std::move(status)));
    return;
  }
  store_.ChangeSession(std::move(change), Notifying(changes_, std::move(done)));
}

Result<PoseBatch> AtlasService::PlacePoses(PoseBatchRequest request) {
  if (Status status = CheckAuthor(request.author); !status.ok()) {
    return Error(std::move(status));
  }
  std::vector<KeyframeKey> keys;
  keys.reserve(request.updates.size());
  for (const PoseBatchRequest::Update& update : request.updates) {
    keys.push_back(update.key);
  }
  const auto keyframes = store_.FindKeyframes(keys);
  if (!keyframes) {
    return Error(keyframes.error());
  }
  PoseBatch batch{{}, std::move(request.author), request.if_revision};
  batch.poses.reserve(keys.size());
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const QuantizedPose& update = request.updates[i].pose;
    const auto& keyframe = (*keyframes)[i];
    auto pose = keyframe ? CheckPose(*keyframe, update, identity().profile)
                         : CheckDroppedPose(keys[i], update);
    if (!pose) {
      return Error(pose.error());
    }
    batch.poses.push_back(std::move(*pose));
  }
  return batch;
}

Status AtlasService::CheckRunning(const std::stop_token& stop) const {
  if (changes_.is_closed()) {
    return Status(StatusCode::kUnavailable, "the daemon is shutting down");
  }
  if (stop.stop_requested()) {
    return Status(StatusCode::kUnavailable, "the peer is gone");
  }
  return {};
}

// Every mark that is left was tried since it was set, and damage was why it failed.
bool AtlasService::IsStuck(const DirtyState& state) const {
  return state.dirty_tiles != 0 && state.failed_tiles == state.dirty_tiles &&
         fusion_.damage().size() >= state.dirty_tiles;
}

Result<AtlasService::WaitEnd> AtlasService::WaitFor(
    const std::function<bool(const DirtyState&)>& is_done,
    TimePoint deadline,
    const std::stop_token& stop,
    DirtyState& state) {
  while (true) {
    const std::uint64_t seen = changes_.version();
    const auto read = store_.ReadDirtyState();
    if (!read) {
      return Error(read.error());
    }
    state = *read;
    if (is_done(state)) {
      return WaitEnd::kDone;
    }
    if (IsStuck(state)) {
      return WaitEnd::kDamaged;
    }
    if (!changes_.WaitPast(seen, deadline, stop)) {
      if (Status status = CheckRunning(stop); !status.ok()) {
        return Error(std::move(status));
      }
      return WaitEnd::kTimedOut;
    }
  }
}

Result<WaitOutcome> AtlasService::WaitUntilClean(const Patience& patience) {
  DirtyState state;
  const auto end = WaitFor(&IsClean, DeadlineOf(patience), patience.stop, state);
  if (!end) {
    return Error(end.error());
  }
  WaitOutcome outcome{state.revision, state.dirty_tiles, *end == WaitEnd::kTimedOut, {}};
  if (*end == WaitEnd::kDamaged) {
    outcome.damage = fusion_.damage().Summary();
  }
  return outcome;
}

Status AtlasService::WaitForRevision(std::uint64_t revision, const Patience& patience) {
  if (const std::uint64_t current = store_.revision(); revision > current) {
    return Status(StatusCode::kInvalidArgument,
                  StrCat("cannot wait for revision ", revision, ", the atlas is at ", current));
  }
  DirtyState state;
  const auto end = WaitFor(
      [revision](const DirtyState& s) { return s.dirty_tiles == 0 || s.oldest_since > revision; },
      DeadlineOf(patience), patience.stop, state);
  if (!end) {
    return end.error();
  }
  if (*end == WaitEnd::kDamaged) {
    return fusion_.damage().Summary();
  }
  if (*end == WaitEnd::kTimedOut) {
    return Status(StatusCode::kTimeout, StrCat("tiles do not reflect revision ", revision,
                                               " yet: ", state.dirty_tiles, " are to be fused"));
  }
  return {};
}

std::function<Status()> AtlasService::CheckFor(const Patience& patience,
                                               std::string too_late) const {
  return [this, deadline = DeadlineOf(patience), stop = patience.stop,
          too_late = std::move(too_late)] {
    ATLAS_RETURN_IF_ERROR(CheckRunning(stop));
    return std::chrono::steady_clock::now() < deadline ? Status()
                                                       : Status(StatusCode::kTimeout, too_late);
  };
}

std::function<Status()> AtlasService::CheckPast(std::uint64_t revision,
                                                const Patience& patience) const {
  return CheckFor(patience, StrCat("the atlas of revision ", revision, " was not fused in time"));
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

Result<std::optional<SyncPlan>> AtlasService::PlanSync(const SyncRequest& request, bool may_block) {
  return atlas::PlanSync(request, store_, store_.identity().profile, may_block);
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
                       ResidentBytes()};
}

Result<AtlasService::WaitEnd> AtlasService::WaitForWorkers(TimePoint deadline,
                                                           const std::stop_token& stop,
                                                           DirtyState& state) {
  auto end = WaitFor(&IsClean, deadline, stop, state);
  if (end && *end == WaitEnd::kTimedOut) {
    return Error(StatusCode::kTimeout,
                 StrCat("the atlas is not clean: ", state.dirty_tiles, " tiles are to be fused"));
  }
  return end;
}

Result<AtlasDigest> AtlasService::Digest(const Patience& patience) {
  const TimePoint deadline = DeadlineOf(patience);
  const auto check_stop = CheckFor(patience, "the digest was not computed in time");
  while (true) {
    DirtyState before;
    const auto end = WaitForWorkers(deadline, patience.stop, before);
    if (!end) {
      return Error(end.error());
    }
    if (*end == WaitEnd::kDamaged) {
      return Error(fusion_.damage().Summary());
    }
    auto digest = ComputeDigest(store_, check_stop);
    if (!digest) {
      return Error(digest.error());
    }
    const auto after = store_.ReadDirtyState();
    if (!after) {
      return Error(after.error());
    }
    if (after->revision == before.revision) {
      digest->revision = before.revision;
      return digest;
    }
    if (std::chrono::steady_clock::now() >= deadline) {
      return Error(StatusCode::kTimeout, "the atlas changes while its digest is computed");
    }
  }
}

Result<AtlasDigest> AtlasService::DigestAt(std::uint64_t revision, const Patience& patience) {
  return past_.Digest(revision, CheckPast(revision, patience));
}

Result<VerifyReport> AtlasService::Verify(bool rebuild, const Patience& patience) {
  const TimePoint deadline = DeadlineOf(patience);
  const auto check_stop = CheckFor(patience, "the atlas was not verified in time");
  while (true) {
    DirtyState clean;
    if (rebuild) {
      const auto end = WaitForWorkers(deadline, patience.stop, clean);
      if (!end) {
        return Error(end.error());
      }
    }
    const auto before = store_.ReadCounts();
    if (!before) {
      return Error(before.error());
    }
    AtlasVerifier::Options options;
    options.rebuild = rebuild;
    options.check_stop = check_stop;
    auto report = AtlasVerifier(store_, options).Run();
    if (!report) {
      return Error(report.error());
    }
    const auto after = store_.ReadCounts();
    if (!after) {
      return Error(after.error());
    }
    report->revision = after->revision;
    // A tile that changed between being read and being rebuilt is no mismatch, and a keyframe that
    // was dropped since it was listed no damage: look again.
    const bool is_in_doubt =
        (rebuild && report->mismatched > 0 && after->revision != clean.revision) ||
        (report->damaged > 0 && after->compacted != before->compacted);
    if (!is_in_doubt) {
      return report;
    }
    if (std::chrono::steady_clock::now() >= deadline) {
      return Error(StatusCode::kTimeout, "the atlas changes while it is verified");
    }
  }
}

Result<CompactionReport> AtlasService::Compact(const CompactionRequest& request,
                                               const Patience& patience) {
  if (Status status = CheckCompaction(request, identity().profile); !status.ok()) {
    return Error(std::move(status));
  }
  const TimePoint deadline = DeadlineOf(patience);
  const auto check_stop = [&] {
    ATLAS_RETURN_IF_ERROR(CheckRunning(patience.stop));
    return std::chrono::steady_clock::now() < deadline
               ? Status()
               : Status(StatusCode::kTimeout, "the atlas was not compacted in time");
  };
  for (int attempt = 0; attempt < kCompactionAttempts; ++attempt) {
    DirtyState clean;
    const auto end = WaitForWorkers(deadline, patience.stop, clean);
    if (!end) {
      return Error(end.error());
    }
    if (*end == WaitEnd::kDamaged) {
      return Error(fusion_.damage().Summary());
    }
    auto report = CompactAt(store_, clean.revision, request, check_stop);
    if (report || report.error().code() != StatusCode::kConflict) {
      changes_.Notify();
      return report;
    }
  }
  return Error(StatusCode::kUnavailable,
               "the atlas keeps changing: try again while nothing is uploaded");
}

}  // namespace atlas
