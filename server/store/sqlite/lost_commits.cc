#include "server/store/sqlite/lost_commits.h"

#include <cstdint>
#include <exception>
#include <utility>

#include "core/base/str_cat.h"
#include "server/store/sqlite/connection/sqlite_error.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/schema/schema.h"
#include "server/store/sqlite/tables/event_table.h"
#include "server/store/sqlite/transactions/counter_check.h"
#include "server/store/sqlite/transactions/new_line.h"

namespace atlas {

Status CheckWhatIsLeft(Connection& writer, const std::string& loss, const char* changed) {
  writer.KeepLog(true);
  Status left;
  try {
    left = CheckCounters(writer);
  } catch (const std::exception& error) {
    left = StatusFromException(error);
  }
  if (left.ok()) {
    return {};
  }
  return {StatusCode::kInvalidData, StrCat(loss, ", and what is left is no atlas (", left.message(),
                                           "): ", changed, "; restore a backup")};
}

Result<std::string> FindLoss(Connection& writer,
                             const StoreIdentity& identity,
                             const DamagedLog& log,
                             const std::optional<NotedRevision>& noted,
                             const char* changed) {
  if (log.is_lossy()) {
    return LossOf(log);
  }
  if (!noted || !IsCounterIntact(writer, Counter::kRevision)) {
    return std::string();
  }
  const std::uint64_t revision = ReadCounter(writer, Counter::kRevision);
  if (!noted->IsBeyond(identity, revision)) {
    return std::string();
  }
  std::string loss =
      StrCat("commits are missing: the atlas was at revision ", noted->revision, " of epoch ",
             noted->epoch, ", and is at revision ", revision, " of epoch ", identity.epoch,
             ": its log (atlas.db-wal) was removed or cut, or an older copy was put in its place");
  // A copy of an earlier version is checked by nobody: it lacks what is made of it behind this.
  const auto version = ReadSchemaVersion(writer);
  const Status left = version && *version == kStoreSchemaVersion
                          ? CheckWhatIsLeft(writer, loss, changed)
                          : Status();
  return left.ok() ? Result<std::string>(std::move(loss)) : Error(left);
}

std::string NoteLoss(Connection& writer,
                     StoreIdentity& identity,
                     const std::string& loss,
                     const std::filesystem::path& kept,
                     const std::optional<NotedRevision>& noted) {
  writer.Begin();
  const std::uint64_t before = ReadCounter(writer, Counter::kRevision);
  const PlaceInLine line = BeginLine(writer, identity, PlaceOf(noted, identity));
  identity.epoch = line.epoch;
  const std::string copy = kept.filename().string();
  std::string what = StrCat(loss, "; the atlas goes on from revision ", before, " in epoch ",
                            line.epoch, copy.empty() ? "" : "; a copy of the log is ", copy);
  AddEvent(writer, {EventKind::kLogDamaged, kAtlasItself, copy, what});
  writer.Commit();
  return what;
}

}  // namespace atlas
