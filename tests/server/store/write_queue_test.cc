// Who shares a transaction shares its end.
#include "server/store/sqlite/connection/write_queue.h"

#include <future>
#include <memory>

#include "server/store/sqlite/connection/sync_guard.h"
#include "tests/server/store/store_fixture.h"

namespace atlas {
namespace {

class WriteQueueTest : public StoreTest {
 protected:
  WriteQueueTest() : guard_([](const Status&) {}) {
    Open();
    store_.reset();
    auto connection = std::make_unique<Connection>(
        DatabaseOptions{Database(), DatabaseOptions::Mode::kReadWrite, 1024, 5'000});
    connection->Execute("CREATE TABLE things(id INTEGER PRIMARY KEY)");
    queue_ = std::make_unique<WriteQueue>(std::move(connection), WriteQueue::Options{}, guard_);
  }

  std::future<Status> Submit(std::function<Status(Connection&)> run) {
    auto done = std::make_shared<std::promise<Status>>();
    WriteQueue::Operation operation;
    operation.run = std::move(run);
    operation.finish = [done](const Status& status) {
      done->set_value(status);
    };
    queue_->Submit(std::move(operation));
    return done->get_future();
  }

  std::int64_t Things() {
    std::int64_t count = -1;
    Submit([&](Connection& connection) {
      count = connection.Ask("SELECT count(*) FROM things");
      return Status();
    }).wait();
    return count;
  }

  SyncGuard guard_;
  std::unique_ptr<WriteQueue> queue_;
};

Status AddThing(Connection& connection) {
  connection.Execute("INSERT INTO things DEFAULT VALUES");
  return {};
}

// As it does where a read fails, whatever the one who read makes of that.
TEST_F(WriteQueueTest, NobodyIsToldOfWhatSqliteGaveUp) {
  std::promise<void> is_busy;
  std::promise<void> may_go_on;  // what is queued until then is one group
  auto first = Submit([&](Connection&) {
    is_busy.set_value();
    may_go_on.get_future().wait();
    return Status();
  });
  is_busy.get_future().wait();
  auto before = Submit(AddThing);
  auto gives_up = Submit([](Connection& connection) {
    connection.Execute("ROLLBACK");
    return Status();
  });
  auto behind = Submit(AddThing);
  may_go_on.set_value();
  EXPECT_EQ(first.get().message(), "");
  EXPECT_EQ(before.get().code(), StatusCode::kUnavailable);
  EXPECT_EQ(gives_up.get().code(), StatusCode::kUnavailable);
  EXPECT_EQ(behind.get().code(), StatusCode::kUnavailable);
  EXPECT_EQ(Things(), 0);
  EXPECT_EQ(Submit(AddThing).get().message(), "");
  EXPECT_EQ(Things(), 1);
}

}  // namespace
}  // namespace atlas
