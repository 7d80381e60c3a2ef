#include "server/store/sqlite/transactions/counter_check.h"

#include "core/base/str_cat.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/schema/table_sums.h"

namespace atlas {
namespace {

struct Recount {
  Counter counter;
  const char* what;
  const char* sql;
};

constexpr Recount kRecounts[] = {
    {Counter::kKeyframes, "keyframes", "SELECT count(*) FROM keyframes"},
    {Counter::kKeyframeBytes, "bytes of keyframes",
     "SELECT coalesce(sum(blob_bytes), 0) FROM keyframes"},
    {Counter::kSessions, "sessions", "SELECT count(*) FROM sessions"},
    {Counter::kTiles, "tiles", "SELECT count(*) FROM tiles"},
    {Counter::kTileBytes, "bytes of tiles", "SELECT coalesce(sum(blob_bytes), 0) FROM tiles"},
    {Counter::kCompactions, "compactions", "SELECT count(*) FROM compactions"},
    {Counter::kCompacted, "keyframes that were dropped", "SELECT count(*) FROM tombstones"},
    {Counter::kHistoryHorizon, "as the oldest revision that is kept",
     "SELECT coalesce(max(revision), 0) FROM compactions"},
};

}  // namespace

Status CheckCounters(Connection& connection) {
  for (const Recount& recount : kRecounts) {
    Query row = connection.Prepare(recount.sql);
    const std::uint64_t found = row.Step() ? row.Unsigned() : 0;
    const std::uint64_t counted = ReadCounter(connection, recount.counter);
    if (found != counted) {
      return Status(StatusCode::kInvalidData, StrCat("store: it counts ", counted, " ",
                                                     recount.what, ", and the rows say ", found));
    }
  }
  return CheckTableSums(connection);
}

}  // namespace atlas
