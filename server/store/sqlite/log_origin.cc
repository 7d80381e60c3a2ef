#include "server/store/sqlite/log_origin.h"

#include <exception>
#include <string>
#include <utility>

#include "core/base/str_cat.h"
#include "server/store/sqlite/connection/log_pages.h"
#include "server/store/sqlite/connection/sqlite_error.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/schema/row_hash.h"
#include "server/store/sqlite/schema/schema.h"

namespace atlas {
namespace {

constexpr int kCache_kib = 256;
constexpr const char* kCountersPage =
    "SELECT rootpage FROM sqlite_master WHERE type = 'table' AND name = 'counters'";

// What cannot be read for damage is not known; what the disk refuses is thrown on.
template <typename T, typename Reading>
std::optional<T> KnownOf(const Reading& read) {
  try {
    return read();
  } catch (const std::exception& error) {
    const StatusCode code = StatusFromException(error).code();
    if (code != StatusCode::kInvalidData && code != StatusCode::kInternal) {
      throw;
    }
    return std::nullopt;
  }
}

Status Refuse(const std::string& what, const char* remedy) {
  return {StatusCode::kConflict, StrCat(what, ": nothing was changed; ", remedy)};
}

}  // namespace

LogOrigin::LogOrigin(std::filesystem::path database, const std::optional<NotedRevision>& noted)
    : database_(std::move(database)), alone_(ReadAlone(database_)) {
  log_.salts = ReadLogSalts(log_file());
  if (has_log() && noted && noted->log.salts == log_.salts) {
    log_ = noted->log;
    atlas_id_ = noted->atlas_id;
  }
}

std::optional<LogOrigin::Place> LogOrigin::ReadPlace(Connection& connection) {
  return KnownOf<Place>([&]() -> std::optional<Place> {
    const std::int64_t page = connection.Ask(kCountersPage);
    const Result<StoreIdentity> identity = ReadMeta(connection);
    if (!identity || !IsCounterIntact(connection, Counter::kRevision)) {
      return std::nullopt;
    }
    return Place{ReadCounter(connection, Counter::kRevision), page, identity->atlas_id};
  });
}

// A kill in the middle of copying the log leaves pages of several commits, of which each is of when
// the log began, or later.
std::optional<LogOrigin::Place> LogOrigin::ReadAlone(const std::filesystem::path& database) {
  return KnownOf<Place>([&] {
    Connection connection({database, DatabaseOptions::Mode::kUntouched, kCache_kib, 0, true});
    AddRowHash(connection);
    return ReadPlace(connection);
  });
}

Status LogOrigin::CheckPlaces(const Place& alone, const Place& both, bool is_log_lossy) const {
  if (atlas_id_ && *atlas_id_ != alone.atlas_id) {
    return Refuse("the log (atlas.db-wal) is of another atlas than the database",
                  "put back the database that was there, or move the log away");
  }
  if (alone.counters_page != both.counters_page) {
    return {};  // the log has made the table anew: what is at its former place says nothing
  }
  if (alone.revision < log_.revision) {
    return Refuse(StrCat("the database is at revision ", alone.revision,
                         ", and its log (atlas.db-wal) goes on from revision ", log_.revision,
                         ": an older copy was put in its place"),
                  "put back the one that was there, or move the log away to go on from the copy");
  }
  if (alone.revision > both.revision && !is_log_lossy) {
    return Refuse(StrCat("the database is at revision ", alone.revision,
                         ", and its log (atlas.db-wal) ends at revision ", both.revision,
                         ": it was cut, or it is an older one"),
                  "put back the one that was there, or move it away");
  }
  return {};
}

Status LogOrigin::Check(Connection& connection, bool is_log_lossy) const {
  if (!has_log()) {
    return {};
  }
  const std::optional<Place> both = alone_ ? ReadPlace(connection) : std::nullopt;
  if (both) {
    ATLAS_RETURN_IF_ERROR(CheckPlaces(*alone_, *both, is_log_lossy));
  }
  const auto pages = static_cast<std::uint64_t>(connection.Ask("PRAGMA page_count"));
  const auto page_bytes = static_cast<std::uint64_t>(connection.Ask("PRAGMA page_size"));
  const auto missing = FindMissingPage(database_, pages, page_bytes);
  return missing ? Status(StatusCode::kInvalidData,
                          StrCat("store: the database is damaged: page ", *missing, " of ", pages,
                                 " is neither in its file nor in its log (atlas.db-wal): it was "
                                 "cut off, or an older copy was put in its place: nothing was "
                                 "changed; put back the one that was there, or restore a backup"))
                 : Status();
}

}  // namespace atlas
