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

NewLine BeginLine(Connection& connection, const StoreIdentity& identity) {
  NewLine line;
  // Two restores of one backup are two lines, too: the clock tells them apart.
  line.epoch = std::max(identity.epoch + 1, NowMs());
  WriteEpoch(connection, identity, line.epoch);
  NextRevision(connection);
  line.revision =
      AddToCounter(connection, Counter::kRevision, static_cast<std::int64_t>(kRevisionsLeftOut));
  return line;
}

}  // namespace atlas
