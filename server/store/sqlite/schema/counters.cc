#include "server/store/sqlite/schema/counters.h"

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

}  // namespace

std::uint64_t ReadCounter(Connection& connection, Counter counter) {
  Query row = connection.Prepare("SELECT value, checksum FROM counters WHERE id = ?");
  row.Bind(static_cast<std::int64_t>(counter));
  if (!row.Step()) {
    ThrowDamaged(StrCat("counter ", static_cast<int>(counter), " is missing"));
  }
  const std::uint64_t value = row.Unsigned();
  if (row.Int() != HashOf(counter, value)) {
    ThrowDamaged(StrCat("counter ", static_cast<int>(counter), " is damaged: wrong checksum"));
  }
  return value;
}

std::uint64_t AddToCounter(Connection& connection, Counter counter, std::int64_t delta) {
  const std::uint64_t value = ReadCounter(connection, counter) + static_cast<std::uint64_t>(delta);
  Write(connection, counter, value);
  return value;
}

void SetCounter(Connection& connection, Counter counter, std::uint64_t value) {
  Write(connection, counter, value);
}

}  // namespace atlas
