#include "server/store/sqlite/schema/counters.h"

namespace atlas {

std::uint64_t ReadCounter(Connection& connection, Counter counter) {
  Query row = connection.Prepare("SELECT value FROM counters WHERE id = ?");
  row.Bind(static_cast<std::int64_t>(counter));
  return row.Step() ? row.Unsigned() : 0;
}

std::uint64_t AddToCounter(Connection& connection, Counter counter, std::int64_t delta) {
  {
    Query update = connection.Prepare("UPDATE counters SET value = value + ? WHERE id = ?");
    update.Bind(delta).Bind(static_cast<std::int64_t>(counter)).Run();
  }
  return ReadCounter(connection, counter);
}

void WriteFusionRules(Connection& connection, std::uint64_t rules) {
  connection
      .Prepare(
          "INSERT INTO counters (id, name, value) VALUES (?1, 'fusion_rules', ?2) "
          "ON CONFLICT (id) DO UPDATE SET value = ?2")
      .Bind(static_cast<std::int64_t>(Counter::kFusionRules))
      .Bind(rules)
      .Run();
}

}  // namespace atlas
