#include "client/vehicle/link_feed.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "core/base/str_cat.h"

namespace atlas {

using std::chrono::milliseconds;

namespace {

// They are not what goes first.
void UseFollowed(TileStore& store, const std::vector<DiscPart>& parts, std::uint8_t finest) {
  for (const TileId& id : store.TilesIn(parts.front().disc, finest)) {
    if (IsFollowed(parts, id, store.atlas().profile)) store.Use(id);
  }
}

// What changes there, nobody asks. Returns how many are left.
std::size_t RemoveOthers(TileStore& store,
                         const std::vector<DiscPart>& parts,
                         std::uint8_t finest) {
  std::size_t followed = 0;
  for (const TileId& id : store.TilesIn(parts.front().disc, finest)) {
    if (IsFollowed(parts, id, store.atlas().profile)) {
      ++followed;
    } else {
      store.Remove(id);
    }
  }
  return followed;
}

void Add(const StoreSyncReport& part, StoreSyncReport& all) {
  if (all.requests == 0) all.revision = part.revision;
  all.tiles += part.tiles;
  all.deltas += part.deltas;
  all.bytes += part.bytes;
  all.requests += part.requests;
  all.is_complete = part.is_complete;
}

}  // namespace

Result<StoreSyncReport> LinkFeed::Sync(TileStore& store,
                                       const MapArea& area,
                                       const AroundOptions& options) {
  if (link_ == nullptr) return Error(StatusCode::kUnavailable, "atlas view: without a link");
  const Clock::time_point end = Clock::now() + options.deadline;
  const Result<AtlasClient*> client = link_->Client(options.deadline);
  if (!client) return Error(client.error());
  const milliseconds left_alone = (*client)->retry_after_of_reads();
  if (left_alone.count() > 0) {
    return Error(StatusCode::kUnavailable,
                 StrCat("atlas view: the daemon wants to be left alone for another ",
                        left_alone.count(), " ms"));
  }
  const auto* disc = std::get_if<DiscArea>(&area);
  Result<StoreSyncReport> report = disc == nullptr ? SyncArea(**client, store, area, options, end)
                                                   : SyncDisc(**client, store, *disc, options, end);
  link_->Report(report ? Status() : report.error());
  return report;
}

Result<StoreSyncReport> LinkFeed::SyncArea(AtlasClient& client,
                                           TileStore& store,
                                           const MapArea& area,
                                           const AroundOptions& options,
                                           Clock::time_point end) {
  const auto left = std::chrono::duration_cast<milliseconds>(end - Clock::now());
  SyncQuery query;
  query.area = area;
  query.finest_level = options.finest_level;
  query.sections = options.sections;
  query.budget_bytes = options.budget_bytes;
  // The daemon stops earlier than the call, so that what it sent until then arrives in time.
  query.give_up = std::max(left, milliseconds(1));
  query.timeout = std::max(query.give_up * 3 / 4, milliseconds(1));
  return SyncStore(client, store, std::move(query), rest_);
}

Result<StoreSyncReport> LinkFeed::SyncDisc(AtlasClient& client,
                                           TileStore& store,
                                           const DiscArea& disc,
                                           const AroundOptions& options,
                                           Clock::time_point end) {
  parts_ = reach_.PartsOf(disc, options.finest_level, store.atlas().profile);
  UseFollowed(store, parts_, options.finest_level);
  Result<StoreSyncReport> report = SyncParts(client, store, options, end);
  if (!report || parts_.size() == 1) return report;
  report->has_room = false;
  if (report->is_complete) {
    reach_.NoteRoom(parts_, RemoveOthers(store, parts_, options.finest_level));
  }
  return report;
}

void LinkFeed::NoteDropped(const TileStore& store, const std::vector<TileId>& dropped) {
  const bool has_room = std::none_of(dropped.begin(), dropped.end(), [&](const TileId& id) {
    return store.Find(id) == nullptr && IsFollowed(parts_, id, store.atlas().profile);
  });
  if (has_room) return;
  reach_.NoteNoRoom(parts_, store.size());
  rest_ = {};  // more of the same
}

Result<StoreSyncReport> LinkFeed::SyncParts(AtlasClient& client,
                                            TileStore& store,
                                            const AroundOptions& options,
                                            Clock::time_point end) {
  StoreSyncReport all;
  for (const DiscPart& part : parts_) {
    AroundOptions rest = options;
    rest.finest_level = part.finest_level;
    const bool has_budget = options.budget_bytes != 0;
    if (has_budget) rest.budget_bytes -= std::min(rest.budget_bytes, all.bytes);
    const bool is_spent = has_budget && rest.budget_bytes == 0;
    const auto report =
        is_spent ? StoreSyncReport{} : SyncArea(client, store, part.disc, rest, end);
    // What is left of the budget may be too little for anything.
    const bool is_too_little = !report && has_budget && all.bytes > 0 &&
                               report.error().code() == StatusCode::kInvalidArgument;
    if (!report && !is_too_little) return Error(report.error());
    Add(report.value_or(StoreSyncReport{}), all);
    if (!all.is_complete) break;
  }
  return all;
}

}  // namespace atlas
