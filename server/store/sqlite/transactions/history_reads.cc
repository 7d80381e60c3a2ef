#include "server/store/sqlite/transactions/history_reads.h"

#include <utility>

#include "core/base/str_cat.h"
#include "server/store/sqlite/schema/counters.h"
#include "server/store/sqlite/tables/footprint_table.h"
#include "server/store/sqlite/tables/keyframe_table.h"

namespace atlas {

Status CheckRevisionKept(Connection& connection, std::uint64_t revision) {
  const std::uint64_t current = ReadCounter(connection, Counter::kRevision);
  if (revision > current) {
    return Status(StatusCode::kInvalidArgument,
                  StrCat("there is no revision ", revision, " yet, the atlas is at ", current));
  }
  const std::uint64_t horizon = ReadCounter(connection, Counter::kHistoryHorizon);
  if (revision < horizon) {
    return Status(StatusCode::kNotFound,
                  StrCat("revision ", revision, " is no longer kept, the oldest is ", horizon));
  }
  return {};
}

Result<TileSources> GatherTileSourcesAt(Connection& connection,
                                        const TileId& id,
                                        std::uint64_t revision) {
  if (Status status = CheckRevisionKept(connection, revision); !status.ok()) {
    return Error(std::move(status));
  }
  TileSources sources;
  sources.revision = revision;
  for (const FootprintRow& row : FootprintsSince(connection, id, 0)) {  // former ones, too
    auto record = ReadKeyframeRecordAt(connection, row.keyframe_id, revision);
    if (!record) {
      return Error(record.error());
    }
    if (*record && IsInMap((*record)->session_state)) {
      sources.keyframes.push_back(std::move(**record));
    }
  }
  return sources;
}

}  // namespace atlas
