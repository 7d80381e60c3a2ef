#include "server/store/sqlite/connection/log_copier.h"

#include <chrono>
#include <exception>

#include "server/store/sqlite/connection/sqlite_error.h"

namespace atlas {

LogCopier::LogCopier(const DatabaseOptions& options,
                     const Limits& limits,
                     Connection& writer,
                     SyncGuard& guard)
    : limits_(limits), guard_(guard), connection_(options), thread_([this] { Loop(); }) {
  writer.LeaveLogTo([this](int pages) { NoteCommit(pages); });
}

LogCopier::~LogCopier() {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
  }
  has_work_.notify_one();
  thread_.join();
}

std::optional<WriteRefusal> LogCopier::last_failure() const {
  const std::lock_guard lock(mutex_);
  return last_failure_;
}

void LogCopier::NoteCommit(int log_pages) {
  if (log_pages >= limits_.max_pages) {
    Copy();
    return;
  }
  const std::lock_guard lock(mutex_);
  if (log_pages < copied_) {
    copied_ = 0;  // the log began anew
  }
  if (log_pages - copied_ >= limits_.pages) {
    is_due_ = true;
    has_work_.notify_one();
  }
}

void LogCopier::Loop() {
  std::unique_lock lock(mutex_);
  while (true) {
    has_work_.wait(lock, [this] { return is_stopping_ || is_due_; });
    if (is_stopping_) {
      return;
    }
    is_due_ = false;
    lock.unlock();
    Copy();
    lock.lock();
  }
}

// What is not copied now is after the next commit: until then it is in the log.
void LogCopier::Copy() {
  const std::lock_guard only_one(copying_);
  if (!guard_.status().ok()) {
    return;
  }
  try {
    if (const auto copied = connection_.CopyLog()) {
      const std::lock_guard lock(mutex_);
      copied_ = *copied;
    }
  } catch (const std::exception& error) {
    guard_.Note(error);
    const std::lock_guard lock(mutex_);
    last_failure_ = {StatusFromException(error), std::chrono::steady_clock::now()};
  }
}

}  // namespace atlas
