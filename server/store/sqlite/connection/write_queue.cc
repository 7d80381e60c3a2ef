#include "server/store/sqlite/connection/write_queue.h"

#include <algorithm>
#include <chrono>
#include <future>
#include <limits>
#include <utility>

#include "core/base/str_cat.h"
#include "server/store/sqlite/connection/sqlite_error.h"

namespace atlas {
namespace {

// What the disk lacks or refuses, which is the same for all.
bool IsOfTheDisk(const Status& status) {
  return status.code() == StatusCode::kResourceExhausted ||
         status.code() == StatusCode::kPermissionDenied;
}

// What all of a group are told whose transaction SQLite gave up in an operation that ended as
// `result`.
Status WhyGivenUp(const Status& result) {
  const bool is_of_all = IsOfTheDisk(result) || result.code() == StatusCode::kUnavailable;
  return is_of_all ? result
                   : Status(StatusCode::kUnavailable,
                            "store: SQLite gave up the transaction of this write");
}

// It ended well, and a statement of it did not.
Status FailedWithin() {
  return {StatusCode::kInternal, "store: a statement of this write failed, and it went on"};
}

}  // namespace

WriteQueue::WriteQueue(std::unique_ptr<Connection> connection,
                       const Options& options,
                       SyncGuard& guard)
    : connection_(std::move(connection)),
      options_(options),
      guard_(guard),
      revision_(options_.read_revision(*connection_)) {
  options_.look(*connection_);
  options_.on_revision(revision());
  thread_ = std::thread([this] { Loop(); });
}

WriteQueue::~WriteQueue() {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
  }
  has_work_.notify_all();
  thread_.join();
}

void WriteQueue::Submit(Operation operation) {
  Submit(std::move(operation), options_.max_queued);
}

void WriteQueue::SubmitProbe(Operation operation) {
  Submit(std::move(operation), std::numeric_limits<std::size_t>::max());
}

void WriteQueue::Submit(Operation operation, std::size_t max_queued) {
  if (!Enqueue(operation, max_queued)) {
    const Status full(StatusCode::kUnavailable,
                      StrCat("store: ", options_.max_queued,
                             " writes are waiting or it is closing; try again later"));
    NoteRefusal(full);
    operation.finish(full);
  }
}

void WriteQueue::Flush() {
  std::promise<void> finished;
  Operation barrier{[](Connection&) { return Status(); },
                    [&finished](const Status&) {
                      finished.set_value();
                    }};
  if (Enqueue(barrier, std::numeric_limits<std::size_t>::max())) {
    finished.get_future().wait();
  }
}

// False, and nothing taken, with a full queue or a stopped one.
bool WriteQueue::Enqueue(Operation& operation, std::size_t max_queued) {
  const std::lock_guard lock(mutex_);
  if (is_stopping_ || queue_.size() >= max_queued) {
    return false;
  }
  queue_.push_back(std::move(operation));
  has_work_.notify_one();
  return true;
}

void WriteQueue::Loop() {
  for (std::vector<Operation> group = TakeGroup(); !group.empty(); group = TakeGroup()) {
    RunGroup(group);
    group.clear();  // what the callbacks hold must not live until the next write
  }
}

// Empty when the queue is stopped and done.
std::vector<WriteQueue::Operation> WriteQueue::TakeGroup() {
  std::unique_lock lock(mutex_);
  has_work_.wait(lock, [this] { return is_stopping_ || !queue_.empty(); });
  const std::size_t size = std::min(queue_.size(), options_.max_group);
  auto end = queue_.begin() + static_cast<std::ptrdiff_t>(size);
  end = std::find_if(queue_.begin(), end, [](const Operation& next) { return next.is_alone; });
  if (end == queue_.begin() && size > 0) {
    ++end;
  }
  std::vector<Operation> group(std::make_move_iterator(queue_.begin()),
                               std::make_move_iterator(end));
  queue_.erase(queue_.begin(), end);
  return group;
}

void WriteQueue::RunGroup(Group group) {
  Ends ends{std::vector<Status>(group.size()), std::nullopt, std::nullopt};
  Status transaction = guard_.status();
  if (transaction.ok()) {
    transaction = RunInTransaction(group, ends);
  }
  if (ends.spoiler && group.size() > 1) {
    RunInParts(group, *ends.spoiler);
    return;
  }
  if (!transaction.ok()) {
    NoteRefusal(transaction);
    Settle(group);  // whether a commit that failed wrote something is not known
  }
  for (std::size_t i = 0; i < group.size(); ++i) {
    const bool is_own = transaction.ok() || ends.gave_up == i;
    group[i].finish(is_own ? ends.results[i] : transaction);
  }
}

// In their order: those before it, it, those behind it. Nobody is told what another made of it.
void WriteQueue::RunInParts(Group group, std::size_t spoiler) {
  const bool is_known = spoiler < group.size();
  const std::size_t first = is_known ? spoiler : group.size() / 2;
  const std::size_t behind = is_known ? spoiler + 1 : first;
  for (const Group part :
       {group.first(first), group.subspan(first, behind - first), group.subspan(behind)}) {
    if (!part.empty()) RunGroup(part);
  }
}

void WriteQueue::Settle(Group group) {
  for (const Operation& operation : group) {
    if (operation.settle) {
      operation.settle();
    }
  }
}

// That a write is wrong in itself is no refusal of the store.
void WriteQueue::NoteRefusal(const Status& status) {
  const StatusCode code = status.code();
  if (code == StatusCode::kResourceExhausted || code == StatusCode::kPermissionDenied ||
      code == StatusCode::kUnavailable) {
    const std::lock_guard lock(mutex_);
    last_refusal_ = {status, std::chrono::steady_clock::now()};
  }
}

WriteFigures WriteQueue::ReadFigures() const {
  WriteFigures figures;
  commits_.AddTo(figures.commits);
  const std::lock_guard lock(mutex_);
  figures.queued = queue_.size();
  figures.last_refusal = last_refusal_;
  return figures;
}

// Not ok: nothing of the group was written.
Status WriteQueue::RunInTransaction(Group group, Ends& ends) {
  try {
    const auto begin = std::chrono::steady_clock::now();
    const int changes_before = connection_->total_changes();
    connection_->Begin();
    ATLAS_RETURN_IF_ERROR(RunAll(group, ends));
    if (Status status = guard_.status(); !status.ok()) {
      return RollBack(std::move(status));
    }
    ATLAS_RETURN_IF_ERROR(WriteDeferred(group, ends));
    const std::uint64_t revision = options_.read_revision(*connection_);
    options_.look(*connection_);
    connection_->Commit();
    if (connection_->total_changes() != changes_before) {
      commits_.Add(std::chrono::steady_clock::now() - begin);
    }
    Settle(group);
    if (revision_.exchange(revision) != revision) {
      options_.on_revision(revision);
    }
    return {};
  } catch (const std::exception& error) {
    guard_.Note(error);
    return RollBack(StatusFromException(error));
  }
}

// Not ok: the transaction is over.
Status WriteQueue::RunAll(Group group, Ends& ends) {
  for (std::size_t i = 0; i < group.size(); ++i) {
    Status& result = ends.results[i];
    result = group[i].is_alone ? group[i].run(*connection_) : RunOne(group[i]);
    if (!connection_->is_in_transaction()) {  // SQLite gave the whole of it up
      ends.gave_up = result.ok() ? std::nullopt : std::optional(i);
      return WhyGivenUp(result);
    }
    if (group[i].is_alone && !result.ok()) {
      return RollBack(result);
    }
    if (connection_->must_be_rolled_back()) {
      ends.spoiler = i;
      return RollBack(result.ok() ? FailedWithin() : result);
    }
  }
  return {};
}

// What is damaged where one of them left a row for later is that one's.
Status WriteQueue::WriteDeferred(Group group, Ends& ends) {
  try {
    connection_->WriteDeferred();
    return {};
  } catch (const std::exception& error) {
    guard_.Note(error);
    Status failure = StatusFromException(error);
    if (!IsOfTheDisk(failure)) ends.spoiler = group.size();
    return RollBack(std::move(failure));
  }
}

Status WriteQueue::RollBack(Status failure) {
  try {
    connection_->RollBack();
    return failure;
  } catch (const std::exception& error) {
    return {failure.code(), StrCat(failure.message(), "; rolling back failed too: ",
                                   StatusFromException(error).message())};
  }
}

Status WriteQueue::RunOne(Operation& operation) {
  Status status;
  connection_->Save();  // where that fails halfway, nothing can be gone back to
  try {
    status = operation.run(*connection_);
  } catch (const std::exception& error) {
    status = StatusFromException(error);
    guard_.Note(error);
    NoteRefusal(status);
  }
  if (!status.ok() && connection_->is_in_transaction()) {
    connection_->RestoreSaved();
  }
  if (connection_->is_in_transaction()) {
    connection_->ReleaseSaved();
  }
  return status;
}

}  // namespace atlas
