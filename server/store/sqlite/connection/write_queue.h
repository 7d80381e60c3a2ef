// The one thread that writes the store: takes what is queued, up to a group of 64 operations, into
// one transaction, and reports to each when that transaction is on disk. An operation that fails
// leaves no trace and does not disturb the others of its group, unless it had written more than the
// cache takes: then all of the group are refused, and those behind it get a transaction each.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <thread>
#include <vector>

#include "core/base/status.h"
#include "server/base/duration_histogram.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/sqlite/connection/sync_guard.h"
#include "server/store/write_figures.h"

namespace atlas {

class WriteQueue {
 public:
  struct Options {
    std::size_t max_queued = 4'096;  // operations; more are refused at once
    std::size_t max_group = 64;      // measured: 14 x the rate of one operation a commit
    // What revision() is: read in each transaction, and once at the start.
    std::function<std::uint64_t(Connection&)> read_revision = [](Connection&) {
      return std::uint64_t{0};
    };
    // Looks at what there is, in each transaction before its commit, and once at the start.
    std::function<void(Connection&)> look = [](Connection&) {
    };
    // Told each revision that is committed, before those who committed it, and once at the start.
    // Must not throw.
    std::function<void(std::uint64_t)> on_revision = [](std::uint64_t) {
    };
  };
  struct Operation {
    // In a savepoint, unless it is alone. Once more, in another transaction, where the first was
    // given up for what another of its group made of it.
    std::function<Status(Connection&)> run;
    std::function<void(const Status&)> finish;  // after the commit; must not block
    // Before that: once all can see what it wrote, or it is certain that nobody will, and before
    // the revision tells of it; must not block, nor throw. May be empty.
    std::function<void()> settle = {};
    // A transaction of its own, without a savepoint, which would keep in memory what it overwrites.
    bool is_alone = false;
  };

  // `guard` outlives this: once it says so, everything is refused.
  WriteQueue(std::unique_ptr<Connection> connection, const Options& options, SyncGuard& guard);
  WriteQueue(const WriteQueue&) = delete;
  WriteQueue& operator=(const WriteQueue&) = delete;
  ~WriteQueue();  // finishes what is queued

  // Never blocks. With a full queue, `finish` is called at once with kUnavailable.
  void Submit(Operation operation);
  // The same, with a full queue too: the one who asks whether it moves must not be refused for it.
  void SubmitProbe(Operation operation);
  // Waits until everything queued so far is finished.
  void Flush();
  // Of what is committed, before those who committed it are told. From any thread.
  std::uint64_t revision() const { return revision_.load(); }
  // From any thread.
  WriteFigures ReadFigures() const;

 private:
  void Submit(Operation operation, std::size_t max_queued);
  bool Enqueue(Operation& operation, std::size_t max_queued);
  void Loop();
  std::vector<Operation> TakeGroup();
  using Group = std::span<Operation>;
  // How each operation ended, and which of them is told so although nothing of its group is
  // written.
  struct Ends {
    std::vector<Status> results;
    std::optional<std::size_t> gave_up;
    // The one that cannot be taken out alone of what the transaction has written; the group's size:
    // it is not known which.
    std::optional<std::size_t> spoiler;
  };
  void RunGroup(Group group);
  void RunInParts(Group group, std::size_t spoiler);
  static void Settle(Group group);
  Status RunInTransaction(Group group, Ends& ends);
  Status RunAll(Group group, Ends& ends);
  Status WriteDeferred(Group group, Ends& ends);
  void NoteRefusal(const Status& status);
  Status RollBack(Status failure);
  Status RunOne(Operation& operation);

  std::unique_ptr<Connection> connection_;
  Options options_;
  SyncGuard& guard_;
  std::atomic<std::uint64_t> revision_;
  DurationHistogram commits_;
  mutable std::mutex mutex_;
  std::condition_variable has_work_;
  std::deque<Operation> queue_;
  bool is_stopping_ = false;
  std::optional<WriteRefusal> last_refusal_;
  std::thread thread_;
};

// `work`, which returns a Result<T>, as a write; `done` gets what it returned once that is on disk.
template <typename T, typename Work>
WriteQueue::Operation MakeWrite(std::function<void(Result<T>)> done, Work work) {
  auto result = std::make_shared<Result<T>>(Error(StatusCode::kInternal, "store: not run"));
  WriteQueue::Operation operation;
  operation.run = [result, work = std::move(work)](Connection& connection) {
    *result = work(connection);
    return result->has_value() ? Status() : result->error();
  };
  operation.finish = [result, done = std::move(done)](const Status& status) {
    if (status.ok()) {
      done(std::move(*result));
    } else {
      done(Error(status));
    }
  };
  return operation;
}

}  // namespace atlas
