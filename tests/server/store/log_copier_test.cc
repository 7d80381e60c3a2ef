#include "server/store/sqlite/connection/log_copier.h"

#include <chrono>
#include <filesystem>
#include <thread>

#include "tests/server/store/store_fixture.h"

namespace atlas {
namespace {

using namespace std::chrono_literals;

constexpr std::uintmax_t kPageBytes = 8'192;
constexpr int kMaxPages = 60;

class LogCopierTest : public StoreTest {
 protected:
  LogCopierTest() { std::filesystem::create_directories(options_.directory); }

  void OpenWith(const LogCopier::Limits& limits) {
    writer_ = std::make_unique<Connection>(
        DatabaseOptions{Database(), DatabaseOptions::Mode::kCreate, 1024, 5'000});
    writer_->Execute("PRAGMA page_size = 8192; PRAGMA journal_mode = WAL");
    writer_->Execute("CREATE TABLE rows (id INTEGER PRIMARY KEY, blob BLOB)");
    copier_ = std::make_unique<LogCopier>(
        DatabaseOptions{Database(), DatabaseOptions::Mode::kReadWrite, 64, 5'000}, limits, *writer_,
        guard_);
  }
  void Close() {
    writer_.reset();
    copier_.reset();
  }
  // Three pages each, and their part of the table.
  void Write(int rows) {
    for (int i = 0; i < rows; ++i) {
      writer_->Execute("INSERT INTO rows (blob) VALUES (zeroblob(24000))");
    }
  }
  std::uintmax_t LogBytes() const {
    return std::filesystem::file_size(Database().string() + "-wal");
  }
  std::uintmax_t DatabaseBytes() const { return std::filesystem::file_size(Database()); }
  std::int64_t RowsOf(Connection& reader) { return reader.Ask("SELECT count(*) FROM rows"); }
  Connection Reader() const { return Connection({Database(), DatabaseOptions::Mode::kReadOnly}); }

  SyncGuard guard_{nullptr};
  std::unique_ptr<Connection> writer_;
  std::unique_ptr<LogCopier> copier_;
};

TEST_F(LogCopierTest, WhatIsCommittedReachesTheDatabaseBesideTheWriter) {
  OpenWith({10, 1'000'000});
  Write(20);
  const auto patience = std::chrono::steady_clock::now() + 20s;
  while (DatabaseBytes() < 30 * kPageBytes && std::chrono::steady_clock::now() < patience) {
    std::this_thread::sleep_for(1ms);
  }
  EXPECT_GE(DatabaseBytes(), 30 * kPageBytes);
}

TEST_F(LogCopierTest, WithoutReadersTheLogIsBounded) {
  OpenWith({10, kMaxPages});
  Write(400);
  EXPECT_LE(LogBytes(), (kMaxPages + 10) * (kPageBytes + 24) + 32);
  Connection reader = Reader();
  EXPECT_EQ(RowsOf(reader), 400);
}

TEST_F(LogCopierTest, AReaderSeesWhatWasThereAndTheLogIsBoundedAfterIt) {
  OpenWith({10, kMaxPages});
  Write(5);
  Connection reader = Reader();
  {
    const Snapshot snapshot(reader);
    EXPECT_EQ(RowsOf(reader), 5);
    Write(100);
    EXPECT_EQ(RowsOf(reader), 5);
  }
  EXPECT_EQ(RowsOf(reader), 105);
  Write(1);
  const std::uintmax_t before = LogBytes();
  Write(400);
  EXPECT_LE(LogBytes(), before);
  EXPECT_EQ(RowsOf(reader), 506);
}

TEST_F(LogCopierTest, WhoIsClosedLastLeavesNoLog) {
  OpenWith({10, kMaxPages});
  Write(30);
  Close();
  EXPECT_FALSE(std::filesystem::exists(Database().string() + "-wal"));
  Connection reader = Reader();
  EXPECT_EQ(RowsOf(reader), 30);
}

}  // namespace
}  // namespace atlas
