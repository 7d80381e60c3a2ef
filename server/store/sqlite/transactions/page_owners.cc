#include "server/store/sqlite/transactions/page_owners.h"

#include <cstdint>
#include <string>
#include <system_error>

#include "core/base/str_cat.h"
#include "server/store/sqlite/tables/session_table.h"

namespace atlas {
namespace {

constexpr const char* kNoWholeMark =
    "SELECT EXISTS (SELECT 1 FROM dirty_tiles) AND NOT EXISTS (SELECT 1 FROM dirty_tiles "
    "WHERE checksum = row_hash(14, key, generation, since))";
constexpr const char* kNoWholeCounter =
    "SELECT EXISTS (SELECT 1 FROM counters) AND NOT EXISTS (SELECT 1 FROM counters "
    "WHERE checksum = row_hash(12, id, value))";

bool IsNoSessionWhole(Connection& connection) {
  const auto damaged = static_cast<std::int64_t>(ListDamagedSessions(connection).size());
  return damaged > 0 && damaged == connection.Ask("SELECT count(*) FROM sessions NOT INDEXED");
}

bool HasPageOfTwo(Connection& connection) {
  Query row = connection.Prepare("PRAGMA quick_check");
  while (row.Step()) {
    row.Rewind();
    if (row.Text().find("2nd reference to page") != std::string::npos) {
      return true;
    }
  }
  return false;
}

}  // namespace

Status CheckPagesAreTheirs(Connection& connection) {
  const bool is_doubtful = connection.Ask(kNoWholeMark) != 0 ||
                           connection.Ask(kNoWholeCounter) != 0 || IsNoSessionWhole(connection);
  return is_doubtful && HasPageOfTwo(connection)
             ? Status(StatusCode::kInvalidData,
                      "store: the database is damaged: a page of a table is another one's, too; "
                      "restore a backup")
             : Status();
}

Status CheckEnd(Connection& connection, const std::filesystem::path& database) {
  const auto pages = static_cast<std::uintmax_t>(connection.Ask("PRAGMA page_count"));
  const auto page_bytes = static_cast<std::uintmax_t>(connection.Ask("PRAGMA page_size"));
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(database, error);
  return error || bytes <= pages * page_bytes
             ? Status()
             : Status(StatusCode::kInvalidData,
                      StrCat("store: the database is damaged: it says that it has ", pages,
                             " pages, and its file has ", bytes / page_bytes,
                             ": nothing was changed; restore a backup"));
}

}  // namespace atlas
