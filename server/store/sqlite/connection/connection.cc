#include "server/store/sqlite/connection/connection.h"

#include <algorithm>
#include <cctype>
#include <exception>
#include <random>

#include <sqlite3.h>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

// Without locks of its own: a connection is for one thread at a time.
int OpenFlags(DatabaseOptions::Mode mode) {
  switch (mode) {
    case DatabaseOptions::Mode::kCreate:
      return SQLite::OPEN_NOMUTEX | SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE;
    case DatabaseOptions::Mode::kReadWrite:
      return SQLite::OPEN_NOMUTEX | SQLite::OPEN_READWRITE;
    case DatabaseOptions::Mode::kUntouched:
      return SQLite::OPEN_NOMUTEX | SQLite::OPEN_READONLY | SQLite::OPEN_URI;
    case DatabaseOptions::Mode::kReadOnly:
      break;
  }
  return SQLite::OPEN_NOMUTEX | SQLite::OPEN_READONLY;
}

constexpr int kMaxIntegers = 16;

void CallIntegerFunction(sqlite3_context* context, int count, sqlite3_value** values) {
  if (count > kMaxIntegers) {
    sqlite3_result_error(context, "more integers than it takes", -1);
    return;
  }
  std::array<std::int64_t, kMaxIntegers> integers{};
  std::transform(values, values + count, integers.begin(), sqlite3_value_int64);
  const auto& function =
      *static_cast<const Connection::IntegerFunction*>(sqlite3_user_data(context));
  try {
    sqlite3_result_int64(context, function({integers.data(), static_cast<std::size_t>(count)}));
  } catch (const std::exception& error) {
    sqlite3_result_error(context, error.what(), -1);
  }
}

// SQLite counts what it holds under a lock that all connections share; nobody asks for it. Once,
// before anything is opened.
void CountNoMemory() {
  [[maybe_unused]] static const int kDone = sqlite3_config(SQLITE_CONFIG_MEMSTATUS, 0);
}

// The file as a URI that says that nobody changes it.
std::string UntouchedUri(const std::string& file) {
  constexpr std::string_view kHex = "0123456789ABCDEF";
  std::string uri = "file:";
  for (const char c : file) {
    const auto byte = static_cast<unsigned char>(c);
    const bool is_plain = std::isalnum(byte) != 0 || c == '/' || c == '.' || c == '_' || c == '-';
    uri += is_plain ? std::string(1, c) : std::string{'%', kHex[byte >> 4U], kHex[byte & 15U]};
  }
  return uri + "?immutable=1";
}

std::string NameToOpen(const DatabaseOptions& options) {
  CountNoMemory();
  const std::string file = options.file.string();
  return options.mode == DatabaseOptions::Mode::kUntouched ? UntouchedUri(file) : file;
}

}  // namespace

Query::Query(Connection& connection, SQLite::Statement& statement)
    : connection_(&connection),
      statement_(&statement),
      spilled_before_(connection.CountSpilled()) {}

Query::~Query() {
  // An error of the last step was thrown by it already; reset only repeats it.
  statement_->tryReset();
}

bool Query::Step() {
  try {
    return statement_->executeStep();
  } catch (const SQLite::Exception&) {
    const bool is_read = std::string_view(statement_->getQuery()).starts_with("SELECT");
    connection_->NoteFailure(is_read ? connection_->CountSpilled() : spilled_before_);
    throw;
  }
}

int Query::Run() {
  try {
    return statement_->exec();
  } catch (const SQLite::Exception&) {
    connection_->NoteFailure(spilled_before_);
    throw;
  }
}

Query& Query::Bind(std::int64_t value) {
  statement_->bind(++parameter_, value);
  return *this;
}

Query& Query::Bind(std::string_view text) {
  statement_->bind(++parameter_, std::string(text));
  return *this;
}

Query& Query::Bind(ByteSpan bytes) {
  const void* data =
      bytes.empty() ? "" : static_cast<const void*>(bytes.data());  // else it is null
  statement_->bindNoCopy(++parameter_, data, static_cast<int>(bytes.size()));
  return *this;
}

Query& Query::BindNull() {
  statement_->bind(++parameter_);
  return *this;
}

std::int64_t Query::Int() {
  const SQLite::Column column = statement_->getColumn(column_++);
  fits_ = fits_ && column.isInteger();
  return column.getInt64();
}

bool Query::Bool() {
  const std::int64_t value = Int();
  fits_ = fits_ && (value == 0 || value == 1);
  return value != 0;
}

std::string Query::Text() {
  const SQLite::Column column = statement_->getColumn(column_++);
  fits_ = fits_ && column.isText();
  return column.getString();
}

Bytes Query::Blob() {
  const SQLite::Column column = statement_->getColumn(column_++);
  fits_ = fits_ && column.isBlob();
  const auto* data = static_cast<const std::uint8_t*>(column.getBlob());
  return {data, data + column.getBytes()};
}

Connection::Connection(const DatabaseOptions& options)
    : database_(NameToOpen(options), OpenFlags(options.mode), options.busy_timeout_ms) {
  std::random_device random;
  std::generate(id_.begin(), id_.end(), [&random] { return static_cast<std::uint8_t>(random()); });
  if (options.takes_any_schema) {
    Execute("PRAGMA writable_schema = ON");  // before what reads it
  }
  // Pages that are written have nothing in them of what moved or went: a purge finds all of it.
  // mmap stays off: a failing disk would be a signal, and mapped pages count as memory.
  Execute(
      StrCat("PRAGMA cache_size = -", options.cache_kib,
             "; PRAGMA mmap_size = 0; PRAGMA synchronous = FULL; PRAGMA secure_delete = FAST;"
             "PRAGMA temp_store = MEMORY; PRAGMA foreign_keys = OFF; PRAGMA trusted_schema = OFF;"
             "PRAGMA recursive_triggers = ON; PRAGMA cell_size_check = ON;"
             "PRAGMA journal_size_limit = 67108864;")
          .c_str());
}

Query Connection::Prepare(const char* sql) {
  auto& statement = statements_[sql];
  if (!statement) {
    statement = std::make_unique<SQLite::Statement>(database_, sql);
  }
  statement->clearBindings();
  return {*this, *statement};
}

void Connection::Execute(const char* sql) {
  const int spilled_before = CountSpilled();
  try {
    database_.exec(sql);
  } catch (const SQLite::Exception&) {
    NoteFailure(spilled_before);
    throw;
  }
}

int Connection::CountSpilled() const {
  int pages = 0;
  int unused = 0;
  sqlite3_db_status(database_.getHandle(), SQLITE_DBSTATUS_CACHE_SPILL, &pages, &unused, 0);
  return pages;
}

void Connection::NoteFailure(int spilled_before) {
  must_be_rolled_back_ = must_be_rolled_back_ || CountSpilled() != spilled_before;
}

std::int64_t Connection::Ask(const char* sql) {
  return database_.execAndGet(sql).getInt64();
}

bool Connection::is_in_transaction() const {
  return sqlite3_get_autocommit(database_.getHandle()) == 0;
}

void Connection::Begin() {
  RollBack();
  for (const auto& deferred : deferred_) {
    deferred->Forget();  // of one that SQLite gave up
  }
  Execute("BEGIN IMMEDIATE");
  must_be_rolled_back_ = false;
}

void Connection::Commit() {
  WriteDeferred();
  if (must_be_rolled_back_) {
    throw SQLite::Exception("a write failed after it had written much; try again", SQLITE_BUSY);
  }
  Execute("COMMIT");
  for (const auto& deferred : deferred_) {
    deferred->Forget();
  }
}

void Connection::RollBack() {
  if (is_in_transaction()) {
    Execute("ROLLBACK");
  }
}

void Connection::Save() {
  Prepare("SAVEPOINT saved").Run();
  spilled_before_save_ = CountSpilled();
  for (const auto& deferred : deferred_) {
    deferred->Save();
  }
}

void Connection::RestoreSaved() {
  Execute("ROLLBACK TO saved");
  NoteFailure(spilled_before_save_);
  for (const auto& deferred : deferred_) {
    deferred->Restore();
  }
}

void Connection::ReleaseSaved() {
  Prepare("RELEASE saved").Run();
}

void Connection::WriteDeferred() {
  std::for_each(deferred_.rbegin(), deferred_.rend(),
                [this](const auto& deferred) { deferred->Write(*this); });
}

void Connection::AddFunction(const char* name, IntegerFunction function) {
  functions_.push_back(std::make_unique<IntegerFunction>(std::move(function)));
  database_.createFunction(name, -1, false, functions_.back().get(), CallIntegerFunction, nullptr,
                           nullptr, nullptr);
}

void Connection::LeaveLogTo(std::function<void(int)> on_commit) {
  on_commit_ = std::move(on_commit);
  const auto hook = [](void* self, sqlite3*, const char*, int pages) {
    static_cast<Connection*>(self)->on_commit_(pages);
    return SQLITE_OK;
  };
  sqlite3_wal_hook(database_.getHandle(), hook, this);
}

void Connection::KeepLog(bool is_kept) {
  sqlite3_db_config(database_.getHandle(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, is_kept ? 1 : 0,
                    nullptr);
}

std::optional<int> Connection::CopyLog() {
  int copied = 0;
  sqlite3* handle = database_.getHandle();
  const int code =
      sqlite3_wal_checkpoint_v2(handle, nullptr, SQLITE_CHECKPOINT_PASSIVE, nullptr, &copied);
  if (code == SQLITE_BUSY) {
    return std::nullopt;
  }
  if (code != SQLITE_OK) {
    throw SQLite::Exception(handle, code);
  }
  return copied;
}

bool Connection::EmptyLog() {
  sqlite3* handle = database_.getHandle();
  const int code =
      sqlite3_wal_checkpoint_v2(handle, nullptr, SQLITE_CHECKPOINT_TRUNCATE, nullptr, nullptr);
  if (code != SQLITE_OK && code != SQLITE_BUSY) {
    throw SQLite::Exception(handle, code);
  }
  return code == SQLITE_OK;
}

void Connection::InterruptWhen(std::function<bool()> is_over) {
  constexpr int kSteps = 100'000;  // of SQLite's machine, about a millisecond
  is_over_ = std::move(is_over);
  const auto ask = [](void* self) {
    return static_cast<Connection*>(self)->is_over_() ? 1 : 0;
  };
  sqlite3_progress_handler(database_.getHandle(), kSteps, ask, this);
}

OverwritingDeletions::~OverwritingDeletions() {
  try {
    connection_.Execute("PRAGMA secure_delete = FAST");
  } catch (const SQLite::Exception&) {
    // Later deletions are then overwritten as well, at the price of time.
  }
}

ToleratedIndexes::~ToleratedIndexes() {
  try {
    connection_.Execute("PRAGMA writable_schema = OFF");
  } catch (const SQLite::Exception&) {
    // No statement here writes the schema; what an index lacks is found by who checks them.
  }
}

Snapshot::~Snapshot() {
  try {
    if (connection_.is_in_transaction()) {
      connection_.Execute("COMMIT");
    }
  } catch (const SQLite::Exception&) {
    // A read transaction has nothing to lose; whoever lends the connection looks whether it is
    // over.
  }
}

}  // namespace atlas
