// The one thread that writes the store: takes what is queued, up to a group of 64 operations, into
// one transaction, and reports to each when that transaction is on disk. An operation that fails
// leaves no trace and does not disturb the others of its group.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"

namespace atlas {

class WriteQueue {
 public:
  struct Options {
    std::size_t max_queued = 4'096;  // operations; more are refused at once
    std::size_t max_group = 64;      // measured: 14 x the rate of one operation a commit
  };
  struct Operation {
    std::function<Status(Connection&)> run;     // in a savepoint
    std::function<void(const Status&)> finish;  // after the commit; must not block
  };

  WriteQueue(std::unique_ptr<Connection> connection, const Options& options);
  WriteQueue(const WriteQueue&) = delete;
  WriteQueue& operator=(const WriteQueue&) = delete;
  ~WriteQueue();  // finishes what is queued

  // Never blocks. With a full queue, `finish` is called at once with kUnavailable.
  void Submit(Operation operation);
  // Waits until everything queued so far is finished.
  void Flush();

 private:
  bool Enqueue(Operation& operation, std::size_t max_queued);
  void Loop();
  std::vector<Operation> TakeGroup();
  void RunGroup(std::vector<Operation>& group);
  Status RunInTransaction(std::vector<Operation>& group, std::vector<Status>& results);
  Status RollBack(Status failure);
  Status RunOne(Operation& operation);

  std::unique_ptr<Connection> connection_;
  Options options_;
  std::mutex mutex_;
  std::condition_variable has_work_;
  std::deque<Operation> queue_;
  bool is_stopping_ = false;
  std::thread thread_;
};

}  // namespace atlas
