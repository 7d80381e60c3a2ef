// Merges that nobody looks at: within limits, and so that one session which cannot be merged keeps
// no other from it. One thread, besides those of a merge.
#pragma once

#include <chrono>
#include <cstdint>
#include <set>
#include <string_view>
#include <vector>

#include "client/merge/merge_run.h"
#include "client/merge/serve/merge_event.h"
#include "client/merge/serve/service_options.h"
#include "client/merge/serve/tried_sessions.h"
#include "client/merge/serve/watched_daemon.h"
#include "core/base/status.h"

namespace atlas {

class UnattendedMerge {
 public:
  // All outlive it; `tried` learns what became of sessions.
  UnattendedMerge(WatchedDaemon& daemon,
                  TriedSessions& tried,
                  const MergeServiceOptions& options,
                  const MergeServiceEnvironment& environment);

  // Merges `keys`, staged ones of `known`, with those of it in the map, as far as nobody uploads to
  // them: all at once, and where that fails or goes over limits, in halves, down to the sessions
  // that it is due to, which are set aside; then those that met nobody in another half with each
  // other. A merge is applied as a whole or not at all, if nothing happened to its sessions since
  // `revision`, when `known` was read; one that was ends the run, for others may fare otherwise by
  // then. Ok: what there is left to do another run does. Else why it has to be done again: a broken
  // link, a conflict, or it is to stop.
  Status Run(const std::vector<SessionKey>& keys,
             const KnownSessions& known,
             std::uint64_t revision);

  // The first failure of a session that was set aside because of it, of all runs; ok: none.
  const Status& failure() const { return failure_; }

 private:
  enum class Fate : std::uint8_t { kDone, kApplied, kUnfit, kPutOff };

  Fate MergeInParts(const std::vector<SessionKey>& keys);
  Fate Merge(const std::vector<SessionKey>& keys);
  Fate Conclude(const std::vector<SessionKey>& keys, const MergeRun& run, std::uint64_t epoch);
  Fate OverLimits(const std::vector<SessionKey>& keys,
                  const MergeRun& run,
                  std::vector<LimitBreach> breaches);
  Fate Failed(const std::vector<SessionKey>& keys, const Status& status);
  Fate Unfit(const MergeEvent& event, const std::set<SessionKey>& about);
  Fate PutOff(const std::vector<SessionKey>& keys, const Status& status);
  // kConflict, too, where the atlas is no longer the one of `epoch`.
  Result<PoseBatchSummary> Apply(const MergeRun& run, std::uint64_t epoch);
  void NoteUnmet(const std::vector<SessionKey>& keys, const MergeRun& run, std::uint64_t applied);
  Status GoOn(std::string_view step, std::size_t done, std::size_t all);

  WatchedDaemon& daemon_;
  TriedSessions& tried_;
  const MergeServiceOptions& options_;
  const MergeServiceEnvironment& environment_;
  Status failure_;
  // Of a run.
  const KnownSessions* known_ = nullptr;
  std::uint64_t known_revision_ = 0;
  std::set<SessionKey> unmet_;
  bool is_split_ = false;
  Status put_off_;
  std::chrono::steady_clock::time_point told_;  // that it goes on
};

}  // namespace atlas
