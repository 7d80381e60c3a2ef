#include "server/store/sqlite/schema/stored_bytes.h"

#include <algorithm>
#include <string_view>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

// A trigger's statement adds `amount` to what the row's vehicle has.
std::string Adding(std::string_view row, std::string_view sign) {
  return StrCat("INSERT INTO vehicle_bytes (vehicle, bytes) VALUES (", row, ".vehicle, ", sign, row,
                ".bytes) ON CONFLICT (vehicle) DO UPDATE SET bytes = bytes + excluded.bytes;");
}

std::uint64_t Number(Connection& connection, const char* pragma) {
  Query row = connection.Prepare(pragma);
  return row.Step() ? row.Unsigned() : 0;
}

}  // namespace

void KeepVehicleBytes(Connection& connection) {
  connection.Execute(
      // Not by the index: a bit in the number of a row, or in an entry's, would end it.
      "CREATE TEMP TABLE vehicle_bytes (vehicle TEXT PRIMARY KEY, bytes INTEGER NOT NULL) "
      "WITHOUT ROWID;"
      "INSERT INTO temp.vehicle_bytes SELECT vehicle, sum(bytes) FROM main.sessions "
      "NOT INDEXED GROUP BY vehicle");
  KeepVehicleBytesOfChanges(connection);
}

void KeepVehicleBytesOfChanges(Connection& connection) {
  const auto trigger = [&connection](const char* event, const std::string& statements) {
    connection.Execute(StrCat("CREATE TEMP TRIGGER vehicle_bytes_", std::string_view(event, 6),
                              " AFTER ", event, " ON main.sessions BEGIN ", statements, " END")
                           .c_str());
  };
  trigger("INSERT", Adding("new", "+"));
  trigger("DELETE", Adding("old", "-"));
  trigger("UPDATE", Adding("old", "-") + Adding("new", "+"));
}

std::uint64_t ReadVehicleBytes(Connection& connection, const std::string& vehicle) {
  Query row = connection.Prepare("SELECT bytes FROM temp.vehicle_bytes WHERE vehicle = ?");
  row.Bind(std::string_view(vehicle));
  return row.Step() ? static_cast<std::uint64_t>(std::max(row.Int(), std::int64_t{0})) : 0;
}

std::uint64_t ReadUsedBytes(Connection& connection) {
  const std::uint64_t pages = Number(connection, "PRAGMA main.page_count");
  const std::uint64_t free_pages = Number(connection, "PRAGMA main.freelist_count");
  return (pages - std::min(pages, free_pages)) * Number(connection, "PRAGMA main.page_size");
}

}  // namespace atlas
