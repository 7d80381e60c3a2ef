#include "client/vehicle/link_feed.h"

#include <algorithm>
#include <utility>

#include "core/base/str_cat.h"

namespace atlas {

Result<StoreSyncReport> LinkFeed::Sync(TileStore& store,
                                       const MapArea& area,
                                       const AroundOptions& options) {
  using Clock = std::chrono::steady_clock;
  using std::chrono::milliseconds;
  if (link_ == nullptr) return Error(StatusCode::kUnavailable, "atlas view: without a link");
  const Clock::time_point start = Clock::now();
  const Result<AtlasClient*> client = link_->Client(options.deadline);
  if (!client) return Error(client.error());
  const milliseconds left_alone = (*client)->retry_after_of_reads();
  if (left_alone.count() > 0) {
    return Error(StatusCode::kUnavailable,
                 StrCat("atlas view: the daemon wants to be left alone for another ",
                        left_alone.count(), " ms"));
  }
  const auto spent = std::chrono::duration_cast<milliseconds>(Clock::now() - start);
  SyncQuery query;
  query.area = area;
  query.finest_level = options.finest_level;
  query.sections = options.sections;
  query.budget_bytes = options.budget_bytes;
  // The daemon stops earlier than the call, so that what it sent until then arrives in time.
  query.give_up = std::max(options.deadline - spent, milliseconds(1));
  query.timeout = std::max(query.give_up * 3 / 4, milliseconds(1));
  Result<StoreSyncReport> report = SyncStore(**client, store, std::move(query), rest_);
  link_->Report(report ? Status() : report.error());
  return report;
}

}  // namespace atlas
