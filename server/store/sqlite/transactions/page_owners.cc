#include "server/store/sqlite/transactions/page_owners.h"

#include <cstdint>
#include <string>

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
                      "store: the database is damaged: a page of a table is another one's, too: "
                      "nothing was changed; restore a backup")
             : Status();
}

}  // namespace atlas
