#include "server/store/sqlite/connection/sync_guard.h"

#include <utility>

#include <SQLiteCpp/Exception.h>
#include <sqlite3.h>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

bool IsFailedSync(const std::exception& error) {
  const auto* sqlite = dynamic_cast<const SQLite::Exception*>(&error);
  const int code = sqlite == nullptr ? SQLITE_OK : sqlite->getExtendedErrorCode();
  return code == SQLITE_IOERR_FSYNC || code == SQLITE_IOERR_DIR_FSYNC;
}

}  // namespace

SyncGuard::SyncGuard(std::function<void(const Status&)> on_failure)
    : on_failure_(std::move(on_failure)) {}

void SyncGuard::Note(const std::exception& error) {
  if (!IsFailedSync(error)) {
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    if (!status_.ok()) {
      return;
    }
    status_ = Status(StatusCode::kUnavailable,
                     StrCat("store: the disk failed to sync (", error.what(),
                            "): nothing is written until the daemon was started again"));
  }
  if (on_failure_) {
    on_failure_(status());
  }
}

Status SyncGuard::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

}  // namespace atlas
