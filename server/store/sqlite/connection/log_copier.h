// Copies what was committed from the write-ahead log into the database, on a thread of its own: the
// writer, which would do it between two groups, goes on meanwhile. The log grows while it is
// written all the time; then the writer waits for what is left to be copied, and begins it anew.
#pragma once

#include <condition_variable>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>

#include "server/store/sqlite/connection/connection.h"
#include "server/store/sqlite/connection/sync_guard.h"
#include "server/store/write_figures.h"

namespace atlas {

class LogCopier {
 public:
  struct Limits {
    int pages = 1'000;      // are copied at a time, as soon as there are so many
    int max_pages = 8'000;  // of the log, 64 MiB: then the writer waits
  };

  // From now on what the writer commits is copied; it must not outlive the copier, which `guard`
  // outlives. Throws as Connection does.
  LogCopier(const DatabaseOptions& options,
            const Limits& limits,
            Connection& writer,
            SyncGuard& guard);
  LogCopier(const LogCopier&) = delete;
  LogCopier& operator=(const LogCopier&) = delete;
  ~LogCopier();

  // All of the log is copied and its file emptied, on the copier's thread, as soon as nobody reads
  // what was before: tried again once a second until then. From any thread.
  void EmptySoon();
  // The disk kept it from copying: what was committed is in the log. From any thread.
  std::optional<WriteRefusal> last_failure() const;

 private:
  void NoteCommit(int log_pages);  // the writer's thread
  void Loop();
  void Copy();
  void Empty();
  void NoteFailure(const std::exception& error);

  const Limits limits_;
  SyncGuard& guard_;
  std::mutex copying_;
  Connection connection_;     // of whoever is copying
  mutable std::mutex mutex_;  // of what follows
  std::condition_variable has_work_;
  int copied_ = 0;  // pages of the log
  bool is_due_ = false;
  bool is_to_be_empty_ = false;
  bool is_stopping_ = false;
  std::optional<WriteRefusal> last_failure_;
  std::thread thread_;
};

}  // namespace atlas
