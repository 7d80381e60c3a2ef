// What SQLite throws, as the Status that callers act on.
#pragma once

#include <exception>
#include <functional>
#include <string>

#include "core/base/status.h"

namespace SQLite {  // NOLINT(readability-identifier-naming): the library's
class Exception;
}

namespace atlas {

// Full disk: kResourceExhausted. Read-only or forbidden: kPermissionDenied. Damage: kInvalidData.
// Failing or busy disk: kUnavailable. Everything else is a mistake of this program: kInternal.
Status StatusFromSqlite(const SQLite::Exception& error);

// Of a call that answers with a code of its own, extended or not, but SQLITE_OK.
Status StatusFromSqliteCode(int code, const char* what);

// For the one place where work runs on a connection: SQLite's exceptions and bad_alloc.
Status StatusFromException(const std::exception& error);

// What `check` says, or kInvalidData where it throws of damage. Everything else that it throws is
// not for it: SQLite may have given the transaction up.
Status StatusOf(const std::function<Status()>& check);

// What is read is not what was written: kInvalidData where the exception becomes a Status.
[[noreturn]] void ThrowDamaged(const std::string& what);

}  // namespace atlas
