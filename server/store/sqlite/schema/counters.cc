#include "server/store/sqlite/schema/counters.h"

#include <optional>
#include <string_view>

#include "core/base/str_cat.h"
#include "server/store/sqlite/connection/sqlite_error.h"
#include "server/store/sqlite/schema/row_hash.h"

namespace atlas {
namespace {

std::int64_t HashOf(Counter counter, std::uint64_t value) {
  return RowHash(RowKind::kCounter).Int(static_cast<std::int64_t>(counter)).Unsigned(value).value();
}

void Write(Connection& connection, Counter counter, std::uint64_t value) {
  connection.Prepare("UPDATE counters SET value = ?, checksum = ? WHERE id = ?")
      .Bind(value)
      .Bind(HashOf(counter, value))
      .Bind(static_cast<std::int64_t>(counter))
      .Run();
}

// Nothing if it is damaged or missing.
std::optional<std::uint64_t> Find(Connection& connection, Counter counter) {
  Query row = connection.Prepare("SELECT value, checksum FROM counters WHERE id = ?");
  row.Bind(static_cast<std::int64_t>(counter));
  if (!row.Step()) {
    return std::nullopt;
  }
  const std::uint64_t value = row.Unsigned();
  return row.IsChecksum(HashOf(counter, value)) ? std::optional(value) : std::nullopt;
}

}  // namespace

std::uint64_t ReadCounter(Connection& connection, Counter counter) {
  const auto value = Find(connection, counter);
  if (!value) {
    ThrowDamaged(StrCat("counter ", static_cast<int>(counter), " is damaged or missing"));
  }
  return *value;
}

std::uint64_t AddToCounter(Connection& connection, Counter counter, std::int64_t delta) {
  const std::uint64_t value = ReadCounter(connection, counter) + static_cast<std::uint64_t>(delta);
  Write(connection, counter, value);
  return value;
}

void SetCounter(Connection& connection, Counter counter, std::uint64_t value) {
  Write(connection, counter, value);
}

std::uint64_t NextNumber(Connection& connection, Counter counter, const char* find) {
  const auto is_taken = [&](std::uint64_t number) {
    Query row = connection.Prepare(find);
    row.Bind(number);
    return row.Step();
  };
  std::uint64_t number = ReadCounter(connection, counter) + 1;
  while (is_taken(number)) {
    ++number;
  }
  return number;
}

std::uint64_t TakeNumber(Connection& connection, Counter counter, const char* find) {
  const std::uint64_t number = NextNumber(connection, counter, find);
  Write(connection, counter, number);
  return number;
}

bool IsCounterIntact(Connection& connection, Counter counter) {
  return Find(connection, counter).has_value();
}

void RewriteCounter(Connection& connection,
                    Counter counter,
                    const char* name,
                    std::uint64_t value) {
  connection.Prepare("INSERT OR REPLACE INTO counters (id, name, value, checksum) VALUES (?,?,?,?)")
      .Bind(static_cast<std::int64_t>(counter))
      .Bind(std::string_view(name))
      .Bind(value)
      .Bind(HashOf(counter, value))
      .Run();
}

}  // namespace atlas
