#include "server/service/fusion/fusion_scheduler.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <future>
#include <utility>

#include "core/base/str_cat.h"
#include "core/fusion/tile_fusion.h"
#include "server/base/thread_priority.h"
#include "server/store/await.h"

namespace atlas {
namespace {

// How often a worker without work looks again: for leases and back-offs that ran out.
constexpr std::chrono::seconds kLookAgain{1};
// Of a tile that fails of damage and has no damaged keyframe: one was deleted under the worker.
constexpr std::uint32_t kQuietTries = 3;
// Of a tile that goes on failing so: about an hour, at the longest back-off.
constexpr std::uint32_t kTriesToLookAgain = 64;

struct Unfinished {
  TileClaim claim;
  bool is_removal = false;
  std::future<Result<FinishResult>> result;
};

}  // namespace

FusionScheduler::FusionScheduler(AtlasStore& store,
                                 ChangeSignal& changes,
                                 WallClock clock,
                                 LogSink log,
                                 TileChanged changed,
                                 const FusionOptions& options)
    : store_(store),
      changes_(changes),
      clock_(std::move(clock)),
      log_(std::move(log)),
      changed_(std::move(changed)),
      options_(options),
      refresher_(store, options.building, log_) {
  if (options_.workers > 0) {
    AdoptRules();  // before anybody can ask what is still to be fused
  }
  for (unsigned i = 0; i < options_.workers; ++i) {
    threads_.emplace_back([this, owner = StrCat("worker-", i)](const std::stop_token& stop) {
      RunWorker(stop, owner);
    });
  }
}

FusionScheduler::~FusionScheduler() {
  Stop();
}

void FusionScheduler::Stop() {
  for (std::jthread& thread : threads_) {
    thread.request_stop();
  }
  threads_.clear();  // joins
  const auto begin = std::chrono::steady_clock::now();
  const std::size_t kept_bytes = refresher_.kept_bytes();
  if (const std::size_t moved_bytes = refresher_.MoveToDisk(); moved_bytes > 0) {
    const std::chrono::duration<double> took_s = std::chrono::steady_clock::now() - begin;
    log_(LogLevel::kInfo, StrCat("fusion: ", moved_bytes >> 20, " of ", kept_bytes >> 20,
                                 " MiB of surveys moved to disk in ", took_s.count(),
                                 " s: ", refresher_.kept_disk_bytes() >> 20, " MiB are there"));
  }
}

void FusionScheduler::RunWorker(const std::stop_token& stop, const std::string& owner) {
  if (options_.nice > 0 && !YieldToOthers(options_.nice)) {
    log_(LogLevel::kWarning, StrCat("fusion: ", owner, " cannot stand back by ", options_.nice,
                                    ": it runs like the others"));
  }
  WorkerPace::Options pace;
  pace.rest_to_wait = options_.nice > 0 ? pace.rest_to_wait : 0;
  Worker worker{owner, WorkerPace(&TimeWithoutCore, pace), {}};
  while (!stop.stop_requested()) {
    const std::uint64_t seen = changes_.version();
    if (!Work(worker, stop)) {
      if (changes_.is_closed()) {
        return;
      }
      changes_.WaitPast(seen, std::chrono::steady_clock::now() + kLookAgain, stop);
    }
  }
}

// An atlas that was fused by the rules of another version is fused again by those of this one.
bool FusionScheduler::AdoptRules() {
  if (has_rules_) {
    return true;
  }
  const auto marks = Await<std::uint64_t>(
      [&](auto done) { store_.AdoptFusionRules(kFusionRules, std::move(done)); });
  const Status problem =
      marks ? Status()
            : marks.error().WithContext("fusion cannot begin, its rules cannot be noted");
  Status before = problem;
  {
    const std::lock_guard lock(start_mutex_);
    std::swap(start_problem_, before);
  }
  if (!marks) {
    if (before.message() != problem.message()) {  // tried every second, by every worker
      log_(LogLevel::kError, problem.message());
    }
    return false;
  }
  if (*marks > 0) {
    log_(LogLevel::kWarning,
         StrCat("fusion: the atlas was fused by other rules than this version's (", kFusionRules,
                "): all ", *marks, " tiles are fused again"));
  }
  has_rules_ = true;
  changes_.Notify();
  return true;
}

Status FusionScheduler::start_problem() const {
  const std::lock_guard lock(start_mutex_);
  return start_problem_;
}

// False when there is nothing to do now. What it throws is not the end of the process: tiles that
// were claimed are claimed again when their lease runs out.
bool FusionScheduler::Work(Worker& worker, const std::stop_token& stop) {
  try {
    const std::vector<TileClaim> claims =
        AdoptRules() && GiveBack(worker) ? NextClaims(worker.owner) : std::vector<TileClaim>();
    if (claims.empty()) {
      return refresher_.StoreIdle();
    }
    BuildClaims(worker, claims, stop);
    return true;
  } catch (const std::exception& error) {
    log_(LogLevel::kError, StrCat("fusion: ", worker.owner, ": ", error.what()));
    return false;
  }
}

std::vector<TileClaim> FusionScheduler::NextClaims(const std::string& owner) {
  while (true) {
    const std::uint64_t wave = wave_;
    const ClaimRequest request{owner, clock_(), options_.lease_ms, options_.tiles_per_claim, wave};
    auto result =
        Await<ClaimResult>([&](auto done) { store_.ClaimDirty(request, std::move(done)); });
    if (!result) {
      const std::string& why = result.error().message();
      log_(claiming_.Fails(why) ? LogLevel::kError : LogLevel::kDebug,
           "fusion: cannot claim tiles: " + why);
      return {};
    }
    if (!result->claims.empty()) {  // else nothing had to be written
      NoteSuccess(claiming_, "claimed");
    }
    if (!result->claims.empty() || !result->is_wave_done || !StartNextWave(wave)) {
      return std::move(result->claims);
    }
  }
}

// False when there is nothing to do beyond the wave `done`.
bool FusionScheduler::StartNextWave(std::uint64_t done) {
  const auto state = store_.ReadDirtyState();
  if (!state) {
    log_(LogLevel::kError, "fusion: cannot read the dirty marks: " + state.error().message());
    return false;
  }
  if (state->dirty_tiles == 0 || state->revision <= done) {
    return wave_ > done;  // another worker started one
  }
  std::uint64_t expected = done;
  wave_.compare_exchange_strong(expected, state->revision);
  return true;
}

// The store writes those that are done while the others are built.
void FusionScheduler::BuildClaims(Worker& worker,
                                  const std::vector<TileClaim>& claims,
                                  const std::stop_token& stop) {
  std::vector<TileId> ids;
  for (const TileClaim& claim : claims) {
    if (stop.stop_requested()) {
      worker.returns.push_back({claim, 0});
    } else {
      if (claim.since <= kReflectsNothing) {
        refresher_.Forget(claim.id);
      }
      ids.push_back(claim.id);
    }
  }
  std::vector<Unfinished> unfinished;
  auto begin = std::chrono::steady_clock::now();
  const auto note_time = [&] {
    building_ns_ += std::chrono::nanoseconds(std::chrono::steady_clock::now() - begin).count();
  };
  Build(ids, stop, [&](const TileId& id, Result<BuiltTile> built) {
    const TileClaim& claim =
        *std::find_if(claims.begin(), claims.end(), [&](const TileClaim& c) { return c.id == id; });
    if (!built && stop.stop_requested()) {
      worker.returns.push_back({claim, 0});
      return;
    }
    if (!built) {
      PostponeFailed(worker, claim, built.error());
      return;
    }
    ++tiles_built_;
    FinishedTile tile{claim, built->revision, std::move(built->content)};
    const bool is_removal = !tile.content;
    unfinished.push_back({claim, is_removal, Begin<FinishResult>([&](auto done) {
                            store_.FinishTile(std::move(tile), std::move(done));
                          })});
    note_time();
    worker.pace.Rest(stop);
    begin = std::chrono::steady_clock::now();
  });
  note_time();
  for (Unfinished& tile : unfinished) {
    const auto result = tile.result.get();
    if (!result && result.error().code() == StatusCode::kConflict) {
      log_(LogLevel::kWarning, "fusion: " + result.error().message());
    } else if (!result) {
      PostponeFailed(worker, tile.claim, result.error());
    } else {
      damage_.Remove(tile.claim.id);  // not before: one that cannot be written is listed as well
      if (result->is_changed) {
        changed_(tile.claim.id, tile.is_removal ? 0 : result->revision);
      }
    }
  }
  GiveBack(worker);
  changes_.Notify();
}

// What it throws (no memory, say) is a failure of these tiles, not the end of the process: they are
// tried one by one then.
void FusionScheduler::Build(std::span<const TileId> ids,
                            const std::stop_token& stop,
                            const TileRefresher::OnBuilt& on_built) {
  std::vector<TileId> rest(ids.begin(), ids.end());
  try {
    refresher_.Build(ids, stop, [&](const TileId& id, Result<BuiltTile> built) {
      std::erase(rest, id);
      on_built(id, std::move(built));
    });
  } catch (const std::exception& error) {
    if (rest.size() == 1) {
      on_built(rest.front(), Error(StatusCode::kInternal, error.what()));
      return;
    }
    for (const TileId& id : rest) {
      Build(std::span(&id, 1), stop, on_built);
    }
  }
}

// False when the store takes none now, a full disk, say: the rest is kept for the next time. A
// damaged store will not take it then either; that lease runs out by itself.
bool FusionScheduler::GiveBack(Worker& worker) {
  const bool has_returns = !worker.returns.empty();
  while (!worker.returns.empty()) {
    const Return& back = worker.returns.back();
    const auto released = Await<bool>(
        [&](auto done) { store_.ReleaseClaim(back.claim, back.retry_at_ms, std::move(done)); });
    if (!released) {
      const std::string& why = released.error().message();
      log_(releasing_.Fails(why) ? LogLevel::kWarning : LogLevel::kDebug,
           StrCat("fusion: cannot release tile ", back.claim.id, ": ", why));
      if (released.error().code() != StatusCode::kInvalidData) {
        return false;
      }
    } else {
      NoteSuccess(releasing_, "released");
    }
    worker.returns.pop_back();
  }
  if (has_returns) {
    changes_.Notify();
  }
  return true;
}

void FusionScheduler::NoteSuccess(RepeatedLine& line, const char* what) {
  if (const std::uint64_t failures = line.Succeeds(); failures > 0) {
    log_(LogLevel::kInfo,
         StrCat("fusion: tiles can be ", what, " again, after ", failures, " failures"));
  }
}

void FusionScheduler::PostponeFailed(Worker& worker, const TileClaim& claim, const Status& why) {
  const std::int64_t backoff =
      std::min(options_.max_backoff_ms, options_.min_backoff_ms << std::min(claim.attempts, 20u));
  const bool is_invalid = why.code() == StatusCode::kInvalidData;
  const bool has_keyframes = is_invalid && claim.id.level == 0;
  const std::optional<bool> has_damage = has_keyframes ? LookForDamage(claim, why) : std::nullopt;
  if (has_damage == false && claim.attempts < kQuietTries) {
    damage_.Remove(claim.id);
    log_(LogLevel::kDebug, StrCat("fusion: tile ", claim.id, " is tried again: ", why.message()));
    worker.returns.push_back({claim, clock_() + 1});
    return;
  }
  const bool is_damage = is_invalid && !(claim.id.level > 0 && MarkDamagedChildren(claim.id));
  bool is_news = true;
  if (is_damage) {
    is_news = damage_.Add(claim.id, why, has_damage.has_value());
  } else {
    damage_.Remove(claim.id);
  }
  log_(is_news ? LogLevel::kError : LogLevel::kDebug,
       StrCat("fusion: tile ", claim.id, " keeps its content and stays dirty, next attempt in ",
              backoff, " ms: ", why.message()));
  worker.returns.push_back({claim, clock_() + backoff});
}

// Which of the tile's keyframes are damaged is looked up, and noted for good. None is where one was
// purged or healed while the tile was built. All are read here: the write that notes them, which
// holds up all others, looks only at those that cannot be; and they are not read at each attempt of
// a tile that fails as it did when they were. Empty: it cannot be noted.
std::optional<bool> FusionScheduler::LookForDamage(const TileClaim& claim, const Status& why) {
  if (claim.attempts % kTriesToLookAgain != 0 && damage_.IsNoted(claim.id, why)) {
    return true;
  }
  const auto keyframes = store_.ListKeyframesOfTile(claim.id);
  const Status noted = keyframes ? NoteUnreadable(*keyframes) : keyframes.error();
  if (!noted.ok()) {
    log_(LogLevel::kError,
         StrCat("fusion: cannot note what is damaged of tile ", claim.id, ": ", noted.message()));
    return std::nullopt;
  }
  const auto damaged = store_.ListDamagedKeyframes();
  return !damaged || std::any_of(damaged->begin(), damaged->end(), [&](const DamagedKeyframe& d) {
    return std::find(keyframes->begin(), keyframes->end(), d.id) != keyframes->end();
  });
}

Status FusionScheduler::NoteUnreadable(std::vector<std::int64_t> keyframes) {
  std::erase_if(keyframes, [&](std::int64_t id) {
    return store_.ReadKeyframe(id).has_value() && store_.ReadKeyframeBlob(id).has_value();
  });
  if (keyframes.empty()) return {};
  const auto noted = Await<std::uint32_t>(
      [&](auto done) { store_.NoteDamage(std::move(keyframes), std::move(done)); });
  return noted ? Status() : noted.error();
}

// True when there are some that can be built again, and the parent then.
bool FusionScheduler::MarkDamagedChildren(const TileId& parent) {
  std::vector<TileId> damaged;
  for (const TileId& child : parent.Children()) {
    const auto tile = store_.ReadTile(child);
    if (!tile && tile.error().code() == StatusCode::kInvalidData && !damage_.Contains(child)) {
      damaged.push_back(child);
    }
  }
  if (damaged.empty()) {
    return false;
  }
  const auto marked =
      Await<std::uint32_t>([&](auto done) { store_.MarkDirty(damaged, std::move(done)); });
  if (!marked) {
    log_(LogLevel::kError, "fusion: cannot mark damaged tiles: " + marked.error().message());
  }
  return marked.has_value();
}

}  // namespace atlas
