// One SQLite connection with its settings and its prepared statements. Owned and used by one thread
// at a time. Everything here throws SQLite::Exception; reader_pool and write_queue turn it into a
// Status.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <unordered_map>
#include <utility>
#include <vector>

#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Statement.h>

#include "core/base/bytes.h"
#include "server/store/sqlite/connection/deferred.h"

namespace atlas {

class Connection;

// A prepared statement in use: bind in order, step, read columns. Frees it for the next use, and
// the read snapshot it may hold, when it goes out of scope.
class Query {
 public:
  Query(Connection& connection, SQLite::Statement& statement);
  Query(const Query&) = delete;
  Query& operator=(const Query&) = delete;
  ~Query();

  Query& Bind(std::int64_t value);
  Query& Bind(std::uint64_t value) { return Bind(static_cast<std::int64_t>(value)); }
  Query& Bind(std::int32_t value) { return Bind(std::int64_t{value}); }
  Query& Bind(std::uint32_t value) { return Bind(std::int64_t{value}); }
  Query& Bind(std::string_view text);
  Query& Bind(ByteSpan bytes);  // must outlive the query
  Query& BindNull();

  // The next row; false after the last one.
  bool Step();
  // Runs a statement without rows; the number of rows it changed.
  int Run();

  // The next column of the row, in order. What is of another type, or out of range, is noted and
  // cut.
  std::int64_t Int();
  std::uint64_t Unsigned() { return static_cast<std::uint64_t>(Int()); }
  std::int32_t Int32() { return Within<std::int32_t>(); }
  std::uint32_t Unsigned32() { return Within<std::uint32_t>(); }
  bool Bool();
  template <typename Enum>
  Enum Enumerator() {
    return static_cast<Enum>(Within<std::underlying_type_t<Enum>>());
  }
  std::string Text();
  Bytes Blob();
  // False: a column since the first was cut. The checksum of what it was cut to may be right, and
  // the row is another.
  bool fits() const { return fits_; }
  // Whether the next column is that, and none before it was cut.
  bool IsChecksum(std::int64_t checksum) { return Int() == checksum && fits_; }
  // Back to the first column: after each Step() of a statement with several rows.
  void Rewind() {
    column_ = 0;
    fits_ = true;
  }

 private:
  template <typename Integer>
  Integer Within() {
    const std::int64_t value = Int();
    fits_ = fits_ && std::in_range<Integer>(value);
    return static_cast<Integer>(value);
  }

  Connection* connection_;
  SQLite::Statement* statement_;
  int spilled_before_;  // of the connection
  int parameter_ = 0;
  int column_ = 0;
  bool fits_ = true;  // every column so far
};

struct DatabaseOptions {
  enum class Mode {
    kCreate,
    kReadWrite,
    kReadOnly,   // writers go on: takes locks in the files beside the database, makes them if need
                 // be
    kUntouched,  // the file alone, without a lock, and nothing beside it: nobody may be writing
  };

  std::filesystem::path file;
  Mode mode = Mode::kReadOnly;
  int cache_kib = 8 * 1024;  // page cache of this connection
  int busy_timeout_ms = 5'000;
  // One that SQLite cannot read, too, for who mends it: until TakeWholeSchemasOnly().
  bool takes_any_schema = false;
};

class Connection {
 public:
  explicit Connection(const DatabaseOptions& options);

  // `sql` is a string literal: statements are kept by its address. Not to be nested in itself.
  Query Prepare(const char* sql);
  void Execute(const char* sql);
  // The first column of the first row of a statement that is run once.
  std::int64_t Ask(const char* sql);
  // Random, of this connection.
  ByteSpan id() const { return id_; }
  // Rows changed since it was opened.
  int total_changes() const { return database_.getTotalChanges(); }
  // False after SQLite rolled the transaction back by itself (full disk, I/O error).
  bool is_in_transaction() const;

  // A write transaction, and one savepoint in it. One that could not be given up before is now.
  void Begin();
  void Commit();
  void RollBack();  // nothing where SQLite did
  void Save();
  void RestoreSaved();
  void ReleaseSaved();
  // Whether part of the transaction was gone back on, a savepoint or a statement that failed, that
  // had written pages to the log, for the cache was full. It must be rolled back, and Commit()
  // refuses it (kUnavailable): if such a page was written twice, SQLite (3.40) leaves what goes to
  // the log behind that without checksums. The commit would be seen as long as somebody has the
  // database open, and be none for who opens it after a kill.
  bool must_be_rolled_back() const { return must_be_rolled_back_; }
  // From now on `deferred` is written before each commit: the last one added first.
  template <typename T>
  T& Defer(std::unique_ptr<T> deferred) {
    T& added = *deferred;
    deferred_.push_back(std::move(deferred));
    return added;
  }
  // Null where none of that kind was added.
  template <typename T>
  T* FindDeferred() const {
    T* found = nullptr;
    for (const auto& deferred : deferred_) {
      found = found == nullptr ? dynamic_cast<T*>(deferred.get()) : found;
    }
    return found;
  }
  // For whoever is about to read what was left for later.
  void WriteDeferred();

  // A function of integers that its statements may call by that name, with any number of them. What
  // it throws fails the statement.
  using IntegerFunction = std::function<std::int64_t(std::span<const std::int64_t>)>;
  void AddFunction(const char* name, IntegerFunction function);

  // Whether what is not in the database yet stays in the log when this connection is closed.
  void KeepLog(bool is_kept);
  // From now on this connection does not copy the log into the database by itself; `on_commit` is
  // told after each commit how many pages the log has. It must not throw.
  void LeaveLogTo(std::function<void(int)> on_commit);
  // Copies as much of the log as readers let it, beside them and a writer. How many of its pages
  // are in the database now; none: another connection is at it.
  std::optional<int> CopyLog();
  // Copies all of the log and leaves its file empty: nothing stays there of what was overwritten in
  // the database. False: readers or a writer are in the way.
  bool EmptyLog();
  // The schema is read again, as it is now.
  void TakeWholeSchemasOnly() { Execute("PRAGMA writable_schema = RESET"); }
  // Asked now and then while a statement runs: true ends it with SQLITE_INTERRUPT. It must not
  // throw.
  void InterruptWhen(std::function<bool()> is_over);

 private:
  friend class PageCopy;
  friend class Query;

  // Pages that were written to the log before their commit, since it was opened.
  int CountSpilled() const;
  // A statement failed that began when so many were.
  void NoteFailure(int spilled_before);

  std::array<std::uint8_t, 16> id_{};
  bool must_be_rolled_back_ = false;
  int spilled_before_save_ = 0;
  std::function<void(int)> on_commit_;
  std::function<bool()> is_over_;
  std::vector<std::unique_ptr<Deferred>> deferred_;
  std::vector<std::unique_ptr<IntegerFunction>> functions_;
  SQLite::Database database_;
  std::unordered_map<const char*, std::unique_ptr<SQLite::Statement>> statements_;
};

// As long as it is there, what the connection deletes is overwritten, also in pages that are free
// from then on.
class OverwritingDeletions {
 public:
  explicit OverwritingDeletions(Connection& connection) : connection_(connection) {
    connection_.Execute("PRAGMA secure_delete = ON");
  }
  OverwritingDeletions(const OverwritingDeletions&) = delete;
  OverwritingDeletions& operator=(const OverwritingDeletions&) = delete;
  ~OverwritingDeletions();

 private:
  Connection& connection_;
};

// As long as it is there, rows are written and deleted also where an index has something else of
// them: who has it makes the indexes anew behind it.
class ToleratedIndexes {
 public:
  explicit ToleratedIndexes(Connection& connection) : connection_(connection) {
    connection_.Execute("PRAGMA writable_schema = ON");
  }
  ToleratedIndexes(const ToleratedIndexes&) = delete;
  ToleratedIndexes& operator=(const ToleratedIndexes&) = delete;
  ~ToleratedIndexes();

 private:
  Connection& connection_;
};

// A read transaction: everything inside sees one state of the atlas.
class Snapshot {
 public:
  explicit Snapshot(Connection& connection) : connection_(connection) {
    connection_.Execute("BEGIN");
  }
  Snapshot(const Snapshot&) = delete;
  Snapshot& operator=(const Snapshot&) = delete;
  ~Snapshot();

 private:
  Connection& connection_;
};

}  // namespace atlas
