#include "server/store/sqlite/schema/row_hash.h"

#include <span>

namespace atlas {

void AddRowHash(Connection& connection) {
  connection.AddFunction("row_hash", [](std::span<const std::int64_t> values) {
    RowHash hash(static_cast<RowKind>(values.empty() ? 0 : values.front()));
    for (const std::int64_t value : values.subspan(values.empty() ? 0 : 1)) {
      hash.Int(value);
    }
    return hash.value();
  });
}

}  // namespace atlas
