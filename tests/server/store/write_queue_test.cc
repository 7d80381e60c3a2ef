// Who shares a transaction shares its end.
#include "server/store/sqlite/connection/write_queue.h"

#include <future>
#include <memory>
#include <new>
#include <utility>

#include <SQLiteCpp/Exception.h>

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

  // What `submit` does is one group; returns what it returned.
  Status SubmitAsOne(const std::function<std::future<Status>()>& submit) {
    std::promise<void> is_busy;
    std::promise<void> may_go_on;
    auto first = Submit([&](Connection&) {
      is_busy.set_value();
      may_go_on.get_future().wait();
      return Status();
    });
    is_busy.get_future().wait();
    auto submitted = submit();
    may_go_on.set_value();
    first.wait();
    return submitted.get();
  }
  // By who opens copies of the files.
  std::int64_t ThingsAfterAKill() const {
    const std::filesystem::path copy = options_.directory / "killed.db";
    for (const char* const suffix : {"", "-wal"}) {
      std::filesystem::copy_file(Database().string() + suffix, copy.string() + suffix,
                                 std::filesystem::copy_options::overwrite_existing);
    }
    std::filesystem::remove(copy.string() + "-shm");
    Connection connection({copy, DatabaseOptions::Mode::kReadOnly, 1'024, 0});
    return connection.Ask("SELECT count(*) FROM things");
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

// What one of them makes of it is of that one.
TEST_F(WriteQueueTest, OthersAreNotToldThatTheyAreWrong) {
  for (const StatusCode code : {StatusCode::kInvalidData, StatusCode::kConflict,
                                StatusCode::kResourceExhausted, StatusCode::kUnavailable}) {
    std::future<Status> gives_up;
    std::vector<std::future<Status>> others;
    const Status behind = SubmitAsOne([&] {
      others.push_back(Submit(AddThing));
      others.push_back(
          Submit([](Connection&) { return Status(StatusCode::kNotFound, "its own"); }));
      gives_up = Submit([code](Connection& connection) {
        connection.Execute("ROLLBACK");
        return Status(code, "as it comes");
      });
      return Submit(AddThing);
    });
    EXPECT_EQ(gives_up.get().code(), code);
    const bool is_full = code == StatusCode::kResourceExhausted;
    const StatusCode of_all = is_full ? code : StatusCode::kUnavailable;
    EXPECT_EQ(behind.code(), of_all);
    for (auto& other : others) {
      EXPECT_EQ(other.get().code(), of_all);
    }
    EXPECT_EQ(Things(), 0);
  }
}

// SQLite would leave what comes behind the second one in the log without checksums: acknowledged,
// seen by all, and gone with the process.
TEST_F(WriteQueueTest, WhatIsAcknowledgedBesideALargeFailureIsThereAfterAKill) {
  Submit([](Connection& connection) {
    connection.Execute("CREATE TABLE large(id INTEGER PRIMARY KEY, bytes BLOB)");
    for (int i = 0; i < 200; ++i) {
      connection.Execute("INSERT INTO large(bytes) VALUES (zeroblob(7000))");
    }
    return Status();
  }).wait();
  const auto fail_largely = [](Connection& connection) {
    for (int i = 0; i < 3; ++i) {
      connection.Execute("UPDATE large SET bytes = randomblob(7000)");
    }
    return Status(StatusCode::kConflict, "as it comes");
  };
  std::vector<std::future<Status>> things;
  const auto failed = SubmitAsOne([&] {
    things.push_back(Submit(AddThing));
    auto large = Submit(fail_largely);
    things.push_back(Submit([](Connection& connection) {
      connection.Execute("INSERT INTO large(bytes) VALUES (zeroblob(70000))");
      return AddThing(connection);
    }));
    return large;
  });
  EXPECT_FALSE(failed.ok());
  std::int64_t acknowledged = 0;
  for (auto& thing : things) {
    acknowledged += thing.get().ok() ? 1 : 0;
  }
  EXPECT_EQ(Things(), acknowledged);
  EXPECT_EQ(ThingsAfterAKill(), acknowledged);
  EXPECT_EQ(Submit(fail_largely).get().code(), StatusCode::kConflict) << "alone it is told why";
  EXPECT_EQ(Submit(AddThing).get().message(), "");
  EXPECT_EQ(ThingsAfterAKill(), acknowledged + 1);
}

// A statement of several rows that fails at its last one is gone back on, too, whoever bears it.
Status FailInAStatement(Connection& connection) {
  try {
    connection
        .Prepare(
            "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 10000) "
            "INSERT INTO keys SELECT randomblob(200), CASE WHEN i = 10000 THEN 1 ELSE i END FROM n")
        .Run();
  } catch (const SQLite::Exception&) {
    return AddThing(connection);
  }
  return {StatusCode::kInternal, "it did not fail"};
}

TEST_F(WriteQueueTest, WhatIsAcknowledgedBehindALargeStatementThatFailedIsThereAfterAKill) {
  Submit([](Connection& connection) {
    connection.Execute("CREATE TABLE keys(random BLOB UNIQUE, number INTEGER UNIQUE)");
    return Status();
  }).wait();
  std::vector<std::future<Status>> things;
  const Status behind = SubmitAsOne([&] {
    things.push_back(Submit(AddThing));
    things.push_back(Submit(FailInAStatement));
    return Submit(AddThing);
  });
  EXPECT_NE(behind.code(), StatusCode::kInternal);
  things.push_back(Submit(FailInAStatement));
  things.push_back(Submit(AddThing));
  std::int64_t acknowledged = behind.ok() ? 1 : 0;
  for (auto& thing : things) {
    const Status status = thing.get();
    acknowledged += status.ok() ? 1 : 0;
    EXPECT_TRUE(status.ok() || status.code() == StatusCode::kInternal) << status.message();
  }
  EXPECT_GE(acknowledged, 2) << "one before it, one behind it, and the last";
  EXPECT_EQ(Things(), acknowledged);
  EXPECT_EQ(ThingsAfterAKill(), acknowledged);
}

// Its part of the group's marks would be gone back on with it.
TEST_F(WriteQueueTest, ASavepointThatCannotBeginLosesNothingOfOthers) {
  class Counter final : public Deferred {
   public:
    void Write(Connection& connection) override {
      for (; added > written; ++written) ASSERT_TRUE(AddThing(connection).ok());
    }
    void Save() override {
      if (std::exchange(fails, false)) throw std::bad_alloc();
      saved = added;
    }
    void Restore() override { added = saved; }
    void Forget() override { added = written = 0; }

    bool fails = false;
    int added = 0;
    int saved = 0;
    int written = 0;
  };
  queue_.reset();
  auto connection = std::make_unique<Connection>(
      DatabaseOptions{Database(), DatabaseOptions::Mode::kReadWrite, 1'024, 5'000});
  connection->Defer(std::make_unique<Counter>());
  queue_ = std::make_unique<WriteQueue>(std::move(connection), WriteQueue::Options{}, guard_);
  std::future<Status> other;
  const Status added = SubmitAsOne([&] {
    auto first = Submit([](Connection& open) {
      auto* counter = open.FindDeferred<Counter>();
      ++counter->added;
      counter->fails = true;
      return Status();
    });
    other = Submit([](Connection&) { return Status(); });
    return first;
  });
  EXPECT_EQ(added.code(), StatusCode::kUnavailable);
  EXPECT_EQ(other.get().code(), StatusCode::kUnavailable);
  EXPECT_EQ(Things(), 0);
}

// In no queue: nobody commits it.
TEST_F(WriteQueueTest, NoCommitIsLeftWithoutChecksums) {
  queue_.reset();
  Connection connection({Database(), DatabaseOptions::Mode::kReadWrite, 1'024, 5'000});
  connection.Execute("CREATE TABLE keys(random BLOB UNIQUE, number INTEGER UNIQUE)");
  connection.Begin();
  EXPECT_TRUE(FailInAStatement(connection).ok());
  EXPECT_TRUE(connection.must_be_rolled_back());
  EXPECT_THROW(connection.Commit(), SQLite::Exception);
  connection.Begin();
  EXPECT_FALSE(connection.must_be_rolled_back());
  EXPECT_TRUE(AddThing(connection).ok());
  connection.Commit();
  EXPECT_EQ(ThingsAfterAKill(), 1);
}

}  // namespace
}  // namespace atlas
