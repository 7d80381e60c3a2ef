#include "client/vehicle/link_feed.h"

#include <algorithm>
#include <utility>

#include "client/vehicle/store_sync.h"

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
  const auto spent = std::chrono::duration_cast<milliseconds>(Clock::now() - start);
  SyncQuery query;
  query.area = area;
  query.finest_level = options.finest_level;
  query.sections = options.sections;
  query.budget_bytes = options.budget_bytes;
  query.timeout = std::max(options.deadline - spent, milliseconds(1));
  Result<StoreSyncReport> report = SyncStore(**client, store, std::move(query));
  link_->Report(report ? Status() : report.error());
  return report;
}

}  // namespace atlas
