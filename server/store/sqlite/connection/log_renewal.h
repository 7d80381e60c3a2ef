// The write-ahead log, written once more before it is read. After a sync that failed the system may
// keep pages that it believes to be on disk and that are not (decision 0501): whoever opens the log
// finds commits in it, goes on behind them, and a power cut leaves a hole before what was
// acknowledged since.
#pragma once

#include <filesystem>

#include "core/base/status.h"

namespace atlas {

// To be called before the database is opened, by whoever holds its directory. Nothing without a
// log; others may read it meanwhile. The file's time stays: it tells what a power cut may have left
// (HasRunSince), also to the next start if this one is refused. Errors as of
// sqlite_error.h.
Status RenewLog(const std::filesystem::path& database);

}  // namespace atlas
