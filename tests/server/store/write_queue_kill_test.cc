// Random groups of writes, large ones, ones that fail and ones that bear a statement that does, in
// a small cache: behind each, what was acknowledged is what whoever opens the files after a kill
// finds.
#include <cstdint>
#include <future>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <SQLiteCpp/Exception.h>

#include "core/base/str_cat.h"
#include "server/store/sqlite/connection/sync_guard.h"
#include "server/store/sqlite/connection/write_queue.h"
#include "tests/core/support/test_scale.h"
#include "tests/server/store/store_fixture.h"

namespace atlas {
namespace {

using Random = std::minstd_rand;

// As somebody might who only looks whether it works, in either way of running a statement.
void FailInAStatement(Connection& connection, std::uint32_t rows) {
  constexpr const char* kStepped =
      "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < ?1) "
      "INSERT INTO keys SELECT randomblob(200), CASE WHEN i = ?1 THEN 1 ELSE i END FROM n "
      "RETURNING number";
  try {
    if (rows % 80 == 0) {
      Query rows_added = connection.Prepare(kStepped);
      rows_added.Bind(rows);
      while (rows_added.Step()) continue;
    } else {
      connection.Execute(
          StrCat("WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < ", rows,
                 ") INSERT INTO keys SELECT randomblob(200), CASE WHEN i = ", rows,
                 " THEN 1 ELSE i END FROM n")
              .c_str());
    }
  } catch (const SQLite::Exception&) {
    return;
  }
}

void ChangeMuch(Connection& connection, Random& random) {
  const auto every = static_cast<std::uint32_t>(1 + random() % 30);
  if (random() % 2 == 0) {
    connection.Execute(
        StrCat("UPDATE large SET bytes = randomblob(7000) WHERE id % ", every, " = 0").c_str());
  } else if (random() % 6 == 0) {
    FailInAStatement(connection, 40 * every);
  } else {
    connection.Execute(
        StrCat("DELETE FROM large WHERE id % 50 = ", every,
               "; INSERT INTO large(bytes) VALUES (randomblob(9000)), (randomblob(20000))")
            .c_str());
  }
}

class WriteQueueKillTest : public StoreTest {
 protected:
  WriteQueueKillTest() : guard_([](const Status&) {}) {
    Open();
    store_.reset();
    auto connection = std::make_unique<Connection>(
        DatabaseOptions{Database(), DatabaseOptions::Mode::kReadWrite, 300, 5'000});
    connection->Execute(
        "CREATE TABLE things(id INTEGER PRIMARY KEY);"
        "CREATE TABLE keys(random BLOB UNIQUE, number INTEGER UNIQUE);"
        "CREATE TABLE large(id INTEGER PRIMARY KEY, bytes BLOB)");
    for (int i = 0; i < 100; ++i) {
      connection->Execute("INSERT INTO large(bytes) VALUES (zeroblob(7000))");
    }
    queue_ = std::make_unique<WriteQueue>(std::move(connection), WriteQueue::Options{}, guard_);
  }

  std::future<Status> Submit(std::function<Status(Connection&)> run) {
    auto done = std::make_shared<std::promise<Status>>();
    queue_->Submit({std::move(run), [done](const Status& status) {
                      done->set_value(status);
                    }});
    return done->get_future();
  }
  std::future<Status> AddThing(std::uint32_t id, std::uint32_t seed) {
    return Submit([id, seed](Connection& connection) -> Status {
      Random random(seed);
      connection.Execute(StrCat("INSERT INTO things VALUES (", id, ")").c_str());
      for (auto steps = random() % 4; steps > 0; --steps) ChangeMuch(connection, random);
      return random() % 5 == 0 ? Status(StatusCode::kConflict, "its own") : Status();
    });
  }
  // In one transaction, if all goes well.
  std::vector<std::future<Status>> AddThings(std::uint32_t first, Random& random) {
    std::promise<void> is_busy;
    std::promise<void> may_go_on;
    auto before = Submit([&](Connection&) {
      is_busy.set_value();
      may_go_on.get_future().wait();
      return Status();
    });
    is_busy.get_future().wait();
    std::vector<std::future<Status>> told;
    for (auto count = 1 + random() % 8; count > 0; --count) {
      told.push_back(AddThing(first + static_cast<std::uint32_t>(told.size()),
                              static_cast<std::uint32_t>(random())));
    }
    may_go_on.set_value();
    before.wait();
    return told;
  }
  std::set<std::uint32_t> ThingsAfterAKill() const {
    const std::filesystem::path copy = options_.directory / "killed.db";
    for (const char* const suffix : {"", "-wal"}) {
      std::filesystem::copy_file(Database().string() + suffix, copy.string() + suffix,
                                 std::filesystem::copy_options::overwrite_existing);
    }
    std::filesystem::remove(copy.string() + "-shm");
    Connection killed({copy, DatabaseOptions::Mode::kReadOnly, 1'024, 0});
    Query check = killed.Prepare("PRAGMA quick_check");
    EXPECT_TRUE(check.Step());
    check.Rewind();
    EXPECT_EQ(check.Text(), "ok");
    std::set<std::uint32_t> found;
    Query thing = killed.Prepare("SELECT id FROM things");
    while (thing.Step()) {
      thing.Rewind();
      found.insert(static_cast<std::uint32_t>(thing.Int()));
    }
    return found;
  }

  SyncGuard guard_;
  std::unique_ptr<WriteQueue> queue_;
};

TEST_F(WriteQueueKillTest, WhatIsThereIsWhatWasAcknowledged) {
  Random random(5);
  std::set<std::uint32_t> acknowledged;
  std::uint32_t next = 1;
  for (std::uint32_t group = 0; group < testing::Scaled(60); ++group) {
    auto told = AddThings(next, random);
    for (std::future<Status>& one : told) {
      const Status status = one.get();
      if (status.ok()) acknowledged.insert(next);
      // Its own, or that a statement of it failed: nothing of others.
      EXPECT_TRUE(status.ok() || status.code() == StatusCode::kConflict ||
                  status.code() == StatusCode::kInternal)
          << status.message();
      ++next;
    }
    ASSERT_EQ(ThingsAfterAKill(), acknowledged) << "behind group " << group;
  }
  EXPECT_GT(acknowledged.size(), next / 2);
}

}  // namespace
}  // namespace atlas
