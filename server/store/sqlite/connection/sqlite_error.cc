#include "server/store/sqlite/connection/sqlite_error.h"

#include <new>
#include <string>
#include <string_view>

#include <SQLiteCpp/Exception.h>
#include <sqlite3.h>
#include <sys/resource.h>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

StatusCode CodeOf(int primary) {
  switch (primary) {
    case SQLITE_FULL:
      return StatusCode::kResourceExhausted;
    case SQLITE_READONLY:
    case SQLITE_PERM:
    case SQLITE_AUTH:
    case SQLITE_CANTOPEN:
      return StatusCode::kPermissionDenied;
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      return StatusCode::kInvalidData;
    case SQLITE_IOERR:
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
    case SQLITE_INTERRUPT:
    case SQLITE_NOMEM:
      return StatusCode::kUnavailable;
    default:
      return StatusCode::kInternal;
  }
}

// What a statement is told whose index somebody dropped.
bool IsWithoutIndex(const SQLite::Exception& error) {
  return error.getErrorCode() == SQLITE_ERROR &&
         std::string_view(error.what()).starts_with("no such index: ");
}

// What one is told whose table or column is not there, or not as it was made.
bool IsWithoutTable(const SQLite::Exception& error) {
  const std::string_view what = error.what();
  return error.getErrorCode() == SQLITE_ERROR &&
         (what.starts_with("no such table: ") || what.starts_with("no such column: ") ||
          what.find(" has no column named ") != std::string_view::npos ||
          what.find("ON CONFLICT clause does not match") != std::string_view::npos);
}

// What a row is told whose number another one has: numbers are given once, so that one is damaged.
bool IsNumberTaken(const SQLite::Exception& error) {
  return error.getExtendedErrorCode() == SQLITE_CONSTRAINT_PRIMARYKEY ||
         error.getExtendedErrorCode() == SQLITE_CONSTRAINT_ROWID;
}

// Where SQLite says itself that the file is damaged: an index that lacks a row can be made anew,
// the text of the schema is known, a page that cannot be read is gone.
const char* AdviceOf(const SQLite::Exception& error) {
  const std::string_view what = error.what();
  if (what.starts_with("malformed database schema")) {
    const bool is_text = what.find("invalid rootpage") == std::string_view::npos;
    return is_text ? "; a start of atlasd may put that right, else restore a backup"
                   : "; restore a backup";
  }
  if (what != sqlite3_errstr(SQLITE_CORRUPT)) {
    return "";
  }
  return error.getExtendedErrorCode() == SQLITE_CORRUPT_INDEX ? "; atlas verify --repair"
                                                              : "; restore a backup";
}

// A write beyond RLIMIT_FSIZE is an error of the disk to SQLite.
std::string LimitOfFiles(const SQLite::Exception& error) {
  rlimit limit{};
  if (error.getExtendedErrorCode() != SQLITE_IOERR_WRITE ||
      ::getrlimit(RLIMIT_FSIZE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) {
    return "";
  }
  return StrCat("; no file may be larger than ", limit.rlim_cur, " bytes here (ulimit -f)");
}

}  // namespace

Status StatusFromSqlite(const SQLite::Exception& error) {
  if (IsWithoutIndex(error)) {
    return Status(StatusCode::kInvalidData, StrCat("store: the database is damaged: ", error.what(),
                                                   "; atlas verify --repair makes it anew"));
  }
  if (IsWithoutTable(error)) {
    return Status(StatusCode::kInvalidData,
                  StrCat("store: the database is damaged: ", error.what(), "; restore a backup"));
  }
  if (IsNumberTaken(error)) {
    return Status(StatusCode::kInvalidData,
                  StrCat("store: the database is damaged: ", error.what(), " (SQLite ",
                         error.getExtendedErrorCode(), "); atlas verify --repair"));
  }
  if (error.getExtendedErrorCode() == SQLITE_IOERR_SHMSIZE) {
    return Status(
        StatusCode::kResourceExhausted,
        StrCat("store: no room on the disk for the index of the log, atlas.db-shm (SQLite ",
               SQLITE_IOERR_SHMSIZE, ")"));
  }
  const int primary = error.getErrorCode() & 0xFF;
  return Status(CodeOf(primary),
                StrCat("store: ", error.what(), " (SQLite ", error.getExtendedErrorCode(), ")",
                       AdviceOf(error), LimitOfFiles(error)));
}

Status StatusFromSqliteCode(int code, const char* what) {
  return Status(CodeOf(code & 0xFF),
                StrCat("store: ", what, ": ", sqlite3_errstr(code), " (SQLite ", code, ")"));
}

void ThrowDamaged(const std::string& what) {
  throw SQLite::Exception(what, SQLITE_CORRUPT);
}

Status StatusFromException(const std::exception& error) {
  if (const auto* sqlite = dynamic_cast<const SQLite::Exception*>(&error)) {
    return StatusFromSqlite(*sqlite);
  }
  if (dynamic_cast<const std::bad_alloc*>(&error) != nullptr) {
    return Status(StatusCode::kUnavailable, "store: out of memory");
  }
  return Status(StatusCode::kInternal, StrCat("store: ", error.what()));
}

Status StatusOf(const std::function<Status()>& check) {
  try {
    return check();
  } catch (const std::exception& error) {
    Status status = StatusFromException(error);
    if (status.code() != StatusCode::kInvalidData) throw;
    return status;
  }
}

}  // namespace atlas
