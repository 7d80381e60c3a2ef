// Whether a log goes on from the database that it lies beside. SQLite asks nothing: it takes the
// pages of the log for those of whatever database has its name, and copies them into it
// (docs/decisions/0511-commits-that-are-missing.md).
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>

#include "core/base/status.h"
#include "server/store/sqlite/connection/connection.h"
#include "server/store/sqlite/revision_note.h"

namespace atlas {

class LogOrigin {
 public:
  // Looks at the two one by one, before a connection that may write has them open. `noted` is what
  // the note beside them says. Throws as Connection does where the disk fails; what cannot be read
  // of the database alone is not known.
  LogOrigin(std::filesystem::path database, const std::optional<NotedRevision>& noted);

  const std::filesystem::path& database() const { return database_; }
  std::filesystem::path log_file() const { return database_.string() + "-wal"; }
  bool has_log() const { return log_.salts != 0; }
  // The log, and from which revision on it goes, if that is known.
  const LogStart& log() const { return log_; }
  // How far the database is without its log, at least: a log that begins later goes on from there.
  std::uint64_t revision_alone() const { return alone_ ? alone_->revision : 0; }

  // By a connection that has both, and knows row_hash (row_hash.h). kConflict: the database is of
  // another atlas, of before the log began, or of behind its end; that only where commits in it are
  // not lost by damage, for it may have copied of those. kInvalidData: it lacks pages that the log
  // does not have. Throws as the connection does where the disk fails.
  Status Check(Connection& connection, bool is_log_lossy) const;

 private:
  // By the counter and the row of the atlas, where both can be read.
  struct Place {
    std::uint64_t revision = 0;
    std::int64_t counters_page = 0;  // the first one of the table that the revision is in
    std::array<std::uint8_t, 16> atlas_id{};
  };
  static std::optional<Place> ReadPlace(Connection& connection);
  static std::optional<Place> ReadAlone(const std::filesystem::path& database);
  Status CheckPlaces(const Place& alone, const Place& both, bool is_log_lossy) const;

  std::filesystem::path database_;
  std::optional<std::array<std::uint8_t, 16>> atlas_id_;  // that the log is of, if that is known
  LogStart log_;
  std::optional<Place> alone_;
};

}  // namespace atlas
