// The fusion workers: threads that lease dirty tiles, build them and store them, level by level.
//
// Work goes in waves. A wave is every mark owed for a change up to one revision; level 0 first,
// then the parents that it marked, so that each parent is built once a wave and no stream of
// uploads can keep the coarse levels waiting. Marks are rows of the store: a restart goes on where
// it stopped.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "server/base/repeated_line.h"
#include "server/service/change_signal.h"
#include "server/service/fusion/damage_list.h"
#include "server/service/fusion/tile_refresher.h"
#include "server/service/fusion/worker_pace.h"
#include "server/service/log_sink.h"
#include "server/store/atlas_store.h"

namespace atlas {

using WallClock = std::function<std::int64_t()>;  // ms since 1970
// A tile has other content than before, on disk; revision 0: it is no more. From any worker.
using TileChanged = std::function<void(const TileId& id, std::uint64_t revision)>;

struct FusionOptions {
  unsigned workers = 1;  // 0: nothing is fused
  int nice = 0;          // steps that they stand back behind the other threads (thread_priority.h)
  TileRefresherOptions building;
  std::uint32_t tiles_per_claim = 16;  // built together and finished in one group commit
  std::int64_t lease_ms = 120'000;
  std::int64_t min_backoff_ms = 1'000;  // doubled with each failure of a tile
  std::int64_t max_backoff_ms = 60'000;
};

class FusionScheduler {
 public:
  FusionScheduler(AtlasStore& store,
                  ChangeSignal& changes,
                  WallClock clock,
                  LogSink log,
                  TileChanged changed,
                  const FusionOptions& options);
  FusionScheduler(const FusionScheduler&) = delete;
  FusionScheduler& operator=(const FusionScheduler&) = delete;
  ~FusionScheduler();

  // Finishes the tiles at hand, gives the other leases back, joins the threads, and writes what is
  // kept to disk.
  void Stop();
  std::uint64_t tiles_built() const { return tiles_built_; }
  // That all workers together spent on building, those that failed included.
  double building_s() const { return 1e-9 * static_cast<double>(building_ns_.load()); }
  std::size_t kept_bytes() const { return refresher_.kept_bytes(); }
  std::size_t kept_disk_bytes() const { return refresher_.kept_disk_bytes(); }
  // Why nothing is fused although there are workers: the store does not take by which rules. Ok
  // once it did.
  Status start_problem() const;
  // Tiles that damage keeps from being fused.
  const DamageList& damage() const { return damage_; }

 private:
  struct Return {
    TileClaim claim;
    std::int64_t retry_at_ms = 0;
  };
  struct Worker {
    std::string owner;
    WorkerPace pace;
    std::vector<Return> returns;  // claims to be given back; no others are taken before they are
  };

  void RunWorker(const std::stop_token& stop, const std::string& owner);
  bool AdoptRules();
  bool Work(Worker& worker, const std::stop_token& stop);
  std::vector<TileClaim> NextClaims(const std::string& owner);
  bool StartNextWave(std::uint64_t done);
  void BuildClaims(Worker& worker,
                   const std::vector<TileClaim>& claims,
                   const std::stop_token& stop);
  void Build(std::span<const TileId> ids,
             const std::stop_token& stop,
             const TileRefresher::OnBuilt& on_built);
  bool GiveBack(Worker& worker);
  void NoteSuccess(RepeatedLine& line, const char* what);
  void PostponeFailed(Worker& worker, const TileClaim& claim, const Status& why);
  std::optional<bool> LookForDamage(const TileClaim& claim, const Status& why);
  Status NoteUnreadable(std::vector<std::int64_t> keyframes);
  bool MarkDamagedChildren(const TileId& parent);

  AtlasStore& store_;
  ChangeSignal& changes_;
  WallClock clock_;
  LogSink log_;
  TileChanged changed_;
  FusionOptions options_;
  TileRefresher refresher_;
  DamageList damage_;
  RepeatedLine claiming_;  // tried every second while the disk is full, as is the next
  RepeatedLine releasing_;
  mutable std::mutex start_mutex_;
  Status start_problem_;                 // with it
  std::atomic<bool> has_rules_ = false;  // the store knows by which rules is fused
  std::atomic<std::uint64_t> wave_ = 0;
  std::atomic<std::uint64_t> tiles_built_ = 0;
  std::atomic<std::int64_t> building_ns_ = 0;
  std::vector<std::jthread> threads_;
};

}  // namespace atlas
