#include "server/store/sqlite/connection/log_copier.h"

#include <chrono>
#include <exception>
#include <utility>

#include "server/store/sqlite/connection/sqlite_error.h"

namespace atlas {
namespace {

constexpr std::chrono::seconds kRetry{1};  // to empty a log that somebody reads

}  // namespace

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

void LogCopier::EmptySoon() {
  const std::lock_guard lock(mutex_);
  is_to_be_empty_ = true;
  is_due_ = true;
  has_work_.notify_one();
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
  const auto has_work = [this] {
    return is_stopping_ || is_due_;
  };
  while (true) {
    if (is_to_be_empty_) {
      has_work_.wait_for(lock, kRetry, has_work);
    } else {
      has_work_.wait(lock, has_work);
    }
    if (is_stopping_) {
      return;
    }
    const bool is_to_be_empty = std::exchange(is_to_be_empty_, false);
    is_due_ = false;
    lock.unlock();
    Copy();
    if (is_to_be_empty) {
      Empty();
    }
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
    NoteFailure(error);
  }
}

// Behind a copy, so that the writer is kept waiting for no more than what came since.
void LogCopier::Empty() {
  const std::lock_guard only_one(copying_);
  if (!guard_.status().ok()) {
    return;
  }
  bool is_empty = false;
  try {
    is_empty = connection_.EmptyLog();
  } catch (const std::exception& error) {
    NoteFailure(error);
  }
  const std::lock_guard lock(mutex_);
  is_to_be_empty_ = is_to_be_empty_ || !is_empty;
  copied_ = is_empty ? 0 : copied_;
}

void LogCopier::NoteFailure(const std::exception& error) {
  guard_.Note(error);
  const std::lock_guard lock(mutex_);
  last_failure_ = {StatusFromException(error), std::chrono::steady_clock::now()};
}

}  // namespace atlas
