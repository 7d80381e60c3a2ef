#include "client/cli/commands/atlas/pose_batch_text.h"

#include <utility>

#include <boost/json/array.hpp>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

void PrintJson(const PoseBatchSummary& batch, const CommandContext& context) {
  boost::json::array sessions;
  for (const SessionEntry& session : batch.sessions) {
    sessions.push_back(boost::json::object{{"vehicle", session.key.vehicle},
                                           {"session", session.key.session},
                                           {"state", session.state},
                                           {"reason", session.reason}});
  }
  context.PrintJson({{"updated", batch.updated},
                     {"tiles_marked", batch.tiles_marked},
                     {"revision", batch.revision},
                     {"batch", batch.batch},
                     {"compacted", batch.compacted},
                     {"sessions", std::move(sessions)}});
}

}  // namespace

void PrintPoseBatch(const PoseBatchSummary& batch, const CommandContext& context) {
  if (context.is_json) {
    PrintJson(batch, context);
    return;
  }
  context.out << batch.updated << " poses moved, " << batch.tiles_marked
              << " tiles to be fused again, revision " << batch.revision << ", batch "
              << batch.batch << '\n';
  if (batch.compacted > 0) {
    context.out << batch.compacted << " of them were dropped by compactions: nothing to move\n";
  }
  for (const SessionEntry& session : batch.sessions) {
    context.out << StrCat(session.key) << " is " << session.state
                << (session.reason.empty() ? "" : ": ") << session.reason << '\n';
  }
}

}  // namespace atlas
