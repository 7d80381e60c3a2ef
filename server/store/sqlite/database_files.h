// What lies on disk of a database that somebody else may have open: SQLite's log and its journal
// stand beside it as long as they matter.
#pragma once

#include <cstdint>
#include <filesystem>

#include "core/base/status.h"

namespace atlas {

struct DatabaseFiles {
  std::filesystem::path database;  // without symbolic links: the others stand beside this one
  std::uint64_t inode = 0;
  std::int64_t size_bytes = 0;
  std::int64_t changed_ns = 0;  // since 1970, by the file system's clock
  bool has_log = false;         // -wal: somebody has it open, or died with it open
  bool is_log_empty = true;
  bool has_log_index = false;  // -shm
  bool has_journal = false;    // -journal, not empty: a transaction that never ended

  // kNotFound, kPermissionDenied: as the disk says. kInvalidArgument: a directory, or no file. None
  // of them is opened: closing it would take SQLite's locks from this process.
  static Result<DatabaseFiles> Look(const std::filesystem::path& file);
  // The same as it is now.
  Result<DatabaseFiles> LookAgain() const { return LookAt(database); }

  // Nobody has it open, and all of it is in the one file.
  bool is_alone() const { return !has_journal && (is_log_empty && !has_log_index); }

  friend bool operator==(const DatabaseFiles&, const DatabaseFiles&) = default;

 private:
  static Result<DatabaseFiles> LookAt(const std::filesystem::path& file);
};

}  // namespace atlas
