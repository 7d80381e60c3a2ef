// Whether the disk ever failed to sync. The system may drop what it could not write, and the next
// sync succeeds all the same (Rebello et al., Can Applications Recover from fsync Failures?, USENIX
// ATC 2020); and whether a commit is there that failed so is known only when the log is read again.
// So no change is taken from then on, until the store is opened anew (log_renewal.h); closing it
// copies what was committed before. Thread-safe.
#pragma once

#include <exception>
#include <functional>
#include <mutex>

#include "core/base/status.h"

namespace atlas {

class SyncGuard {
 public:
  // `on_failure` is told once, by whichever thread was writing; it must not block.
  explicit SyncGuard(std::function<void(const Status&)> on_failure);

  // What a write or a copy threw.
  void Note(const std::exception& error);
  // kUnavailable: nothing may be written any more.
  Status status() const;

 private:
  const std::function<void(const Status&)> on_failure_;
  mutable std::mutex mutex_;
  Status status_;
};

}  // namespace atlas
