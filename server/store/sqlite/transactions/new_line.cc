#include "server/store/sqlite/transactions/new_line.h"

#include <algorithm>
#include <chrono>

#include "server/store/backup_types.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/schema/schema.h"
#include "server/store/sqlite/tables/start_table.h"

namespace atlas {
namespace {

std::uint64_t NowMs() {
  using std::chrono::milliseconds;
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return static_cast<std::uint64_t>(std::chrono::duration_cast<milliseconds>(now).count());
}

}  // namespace

PlaceInLine BeginLine(Connection& connection,
                      const StoreIdentity& identity,
                      const PlaceInLine& lost) {
  PlaceInLine begin;
  // Two restores of one backup are two lines, too: the clock tells them apart.
  begin.epoch = std::max({identity.epoch + 1, lost.epoch + 1, NowMs()});
  WriteEpoch(connection, identity, begin.epoch);
  const std::uint64_t number = LineOf(NextRevision(connection));
  const std::uint64_t lines = std::max(number, LineOf(lost.revision)) + 1 - number;
  begin.revision = AddToCounter(connection, Counter::kRevision,
                                static_cast<std::int64_t>(lines * kRevisionsLeftOut));
  return begin;
}

}  // namespace atlas
