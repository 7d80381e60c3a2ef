// How far a long piece of work may be by now, so that others get their share of the disk.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <thread>

#include "core/base/status.h"
#include "server/store/backup_types.h"

namespace atlas {

class WorkPace {
 public:
  // `work` outlives it.
  WorkPace(const BackupWork& work, BackupProgress::Stage stage, std::uint64_t total_bytes)
      : work_(work), progress_{stage, 0, total_bytes} {}

  // So much is done altogether: tells so, and waits until it may be. What ends the work ends it.
  Status Reach(std::uint64_t done_bytes) {
    progress_.done_bytes = std::min(done_bytes, progress_.total_bytes);
    work_.on_progress(progress_);
    while (true) {
      ATLAS_RETURN_IF_ERROR(work_.check_stop());
      const auto early = Due(done_bytes) - Clock::now();
      if (early <= Clock::duration::zero()) {
        return {};
      }
      std::this_thread::sleep_for(std::min<Clock::duration>(early, kNap));
    }
  }
  Status Add(std::uint64_t bytes) { return Reach(progress_.done_bytes + bytes); }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kNap{20};

  Clock::time_point Due(std::uint64_t done_bytes) const {
    if (work_.bytes_per_s <= 0) {
      return began_;
    }
    const std::chrono::duration<double> s(static_cast<double>(done_bytes) / work_.bytes_per_s);
    return began_ + std::chrono::duration_cast<Clock::duration>(s);
  }

  const BackupWork& work_;
  BackupProgress progress_;
  const Clock::time_point began_ = Clock::now();
};

}  // namespace atlas
