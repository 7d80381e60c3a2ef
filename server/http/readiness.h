// Whether the daemon should be sent work: not while it stops, not while its store refuses writes.
#pragma once

#include <chrono>
#include <memory>

#include "core/base/status.h"
#include "server/http/liveness.h"
#include "server/service/atlas_service.h"
#include "server/store/atlas_store.h"

namespace atlas {

struct ReadinessOptions {
  // A disk that is nearly full takes the small write of a probe and refuses the next upload: what
  // was refused counts for so long.
  std::chrono::milliseconds refusal{5'000};
  std::chrono::milliseconds patience{1'000};  // for a probe
  std::chrono::milliseconds fresh{1'000};     // the outcome of a probe, so that asking costs little
};

class Readiness {
 public:
  // Both outlive this.
  Readiness(AtlasService& service, AtlasStore& store, const ReadinessOptions& options = {});

  // The reason why not. From one thread.
  Status Check();

 private:
  using Clock = std::chrono::steady_clock;
  struct Probe;

  Status CheckDisk();

  AtlasService& service_;
  AtlasStore& store_;
  ReadinessOptions options_;
  std::shared_ptr<Probe> probe_;
  Liveness writer_;
  Status disk_;  // as of then
  Clock::time_point disk_checked_at_;
};

}  // namespace atlas
