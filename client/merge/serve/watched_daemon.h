// The daemon of a service that merges sessions: reached again whenever it was lost, and one that
// takes a merge. One thread.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "client/connection/atlas_client.h"
#include "client/merge/serve/service_options.h"
#include "client/vehicle/atlas_link.h"
#include "core/base/status.h"

namespace atlas {

class WatchedDaemon {
 public:
  using Clock = std::chrono::steady_clock;

  // The environment outlives it.
  WatchedDaemon(LinkOptions link, const MergeServiceEnvironment& environment);

  // Waits for a connection until it is to stop (kUnavailable), until `latest` (the last failure) or
  // until there will be none: refusal(). Valid until the next call.
  Result<AtlasClient*> Wait(std::optional<Clock::time_point> latest = std::nullopt);
  // What a call of the client came to. True: it broke the connection, or there was none left.
  bool Report(const Status& status);

  // Ok, or what takes people to put right: kPermissionDenied for a role that may not merge,
  // kUnsupported for a daemon before 1.11, kConflict for another atlas than before, and what the
  // daemon refuses for good.
  const Status& refusal() const { return refusal_; }

 private:
  void Lost(const Status& status);

  const MergeServiceEnvironment& environment_;
  AtlasLink link_;
  Status refusal_;
  bool is_told_connected_ = false;
  bool is_told_lost_ = false;
};

}  // namespace atlas
