// Watches a daemon and merges the staged sessions that nobody uploads to any more, one merge at a
// time, for as long as it is let. What it knows of a daemon is in memory: a service that begins
// anew looks at everything once more. One thread, besides those of a merge.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>

#include "client/merge/serve/service_options.h"
#include "client/merge/serve/settled_sessions.h"
#include "client/merge/serve/tried_sessions.h"
#include "client/merge/serve/unattended_merge.h"
#include "client/merge/serve/watched_daemon.h"
#include "client/vehicle/atlas_link.h"
#include "core/base/status.h"

namespace atlas {

class MergeService {
 public:
  // Requires valid options.
  MergeService(LinkOptions link, MergeServiceOptions options, MergeServiceEnvironment environment);

  // Until it is to stop: ok, and every merge was applied as a whole or not at all. Links that break
  // and daemons that are away are waited for; what WatchedDaemon::refusal says ends it. Of one
  // round
  // (`is_once`) any failure: kUnavailable without a daemon, why something was put off, or the first
  // failure of a session that was set aside.
  Status Run();

 private:
  using Clock = std::chrono::steady_clock;
  using Settled = std::map<SessionKey, SessionMark>;

  Status RunOnce();
  // What a call came to, told of where nobody else does.
  Status Reported(const Status& status);
  Status Round(AtlasClient& client);
  // By now; lists nothing where nothing happened.
  Status LookAtSessions(AtlasClient& client);
  bool IsDoneWith(const Settled& settled, Clock::time_point now) const;
  Result<KnownSessions> ReadKnown(AtlasClient& client, const Settled& settled);
  std::chrono::milliseconds Pause() const;
  void ForgetOtherEpochs(std::uint64_t epoch);

  MergeServiceOptions options_;
  MergeServiceEnvironment environment_;
  WatchedDaemon daemon_;
  TriedSessions tried_;
  UnattendedMerge merge_;
  std::optional<std::uint64_t> epoch_;  // of the atlas that all this is about
  SettledSessions settled_;
  std::optional<std::uint64_t> seen_revision_;  // when the sessions were listed
  // Settled sessions of which there was nothing more to do, at that revision and time.
  std::optional<Settled> done_with_;
  std::uint64_t done_revision_ = 0;
  Clock::time_point done_at_;
  int failed_rounds_ = 0;  // since one went well
};

}  // namespace atlas
