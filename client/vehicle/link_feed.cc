#include "client/vehicle/link_feed.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "client/vehicle/area_touch.h"
#include "core/base/str_cat.h"

namespace atlas {

using std::chrono::milliseconds;

namespace {

// Below that a request may be refused for its budget: what comes first in a reply says what is held
// of the area.
constexpr std::uint64_t kMaxBeforeTiles_bytes = 64 << 10;
// What is left beside: a file takes some bytes more than what is sent of it.
constexpr std::uint64_t kSpare = 32;
// The least tile with its announcement is more.
constexpr std::uint64_t kLeastRoom_bytes = 256;

// Of those that are held.
std::vector<TileId> Followed(const TileStore& store, const std::vector<DiscPart>& parts) {
  if (parts.empty()) return {};
  std::vector<TileId> ids = store.TilesIn(parts.front().disc, parts.back().finest_level);
  std::erase_if(ids,
                [&](const TileId& id) { return !IsFollowed(parts, id, store.atlas().profile); });
  return ids;
}

// They are not what goes first.
void Use(TileStore& store, const std::vector<TileId>& ids) {
  for (const TileId& id : ids) {
    store.Use(id);
  }
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
  Result<StoreSyncReport> report = disc == nullptr ? SyncBeside(**client, store, area, options, end)
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
  may_grow_ = false;
  const std::vector<TileId> followed = Followed(store, parts_);
  Use(store, followed);
  const bool is_whole = IsWhole(parts_, options.finest_level);
  if (!is_whole) store.RemoveCoarse(followed);
  Result<StoreSyncReport> report = SyncParts(client, store, options, end);
  const std::optional<MapArea> beside = std::exchange(beside_, std::nullopt);
  if (!report || is_whole) return report;
  report->has_room = false;
  may_grow_ = report->is_complete;
  if (report->is_complete) RemoveOthers(store, options.finest_level, beside);
  return report;
}

// What changes there, nobody asks, unless something else did.
void LinkFeed::RemoveOthers(TileStore& store,
                            std::uint8_t finest,
                            const std::optional<MapArea>& beside) const {
  const MapProfile& profile = store.atlas().profile;
  for (const TileId& id : store.TilesIn(parts_.front().disc, finest)) {
    const bool is_asked =
        IsFollowed(parts_, id, profile) || (beside && Touches(*beside, id, profile));
    if (!is_asked) store.Remove(id);
  }
}

void LinkFeed::NoteDropped(const TileStore& store, const std::vector<TileId>& dropped) {
  const MapProfile& profile = store.atlas().profile;
  const bool had_room = std::none_of(dropped.begin(), dropped.end(), [&](const TileId& id) {
    return store.Find(id) == nullptr && IsFollowed(parts_, id, profile);
  });
  if (!had_room) {
    reach_.NoteNoRoom(parts_, profile);
    rest_ = {};  // more of the same
  } else if (may_grow_) {
    const std::vector<TileId> followed = Followed(store, parts_);
    const std::vector<TileId> inner = Followed(store, InnerHalf(parts_));
    reach_.NoteRoom(parts_, {.all = store.BytesOf(followed),
                             .inner_half = store.BytesOf(inner),
                             .room = store.RoomAmong(followed)});
  }
  may_grow_ = false;
}

Result<StoreSyncReport> LinkFeed::SyncBeside(AtlasClient& client,
                                             TileStore& store,
                                             const MapArea& area,
                                             const AroundOptions& options,
                                             Clock::time_point end) {
  beside_.reset();
  const std::uint64_t unused_bytes =
      store.capacity_bytes() - std::min(store.capacity_bytes(), store.held_bytes());
  if (options.budget_bytes != 0 && options.budget_bytes <= unused_bytes) {
    Result<StoreSyncReport> report = SyncArea(client, store, area, options, end);
    if (report && report->is_complete) beside_ = area;
    return report;
  }
  const std::uint64_t room_bytes = MakeRoomBeside(store, area, options.finest_level);
  const bool is_bound = options.budget_bytes == 0 || room_bytes < options.budget_bytes;
  StoreSyncReport none;
  none.has_room = false;
  if (is_bound && room_bytes < kLeastRoom_bytes) return none;
  AroundOptions rest = options;
  if (is_bound) rest.budget_bytes = room_bytes;
  // Later than that the daemon stops for the time.
  const Clock::time_point late = end - (end - Clock::now()) / 4;
  Result<StoreSyncReport> report = SyncArea(client, store, area, rest, end);
  const bool is_refused = !report && report.error().code() == StatusCode::kInvalidArgument;
  if (is_bound && is_refused && room_bytes < kMaxBeforeTiles_bytes) return none;
  if (!report) return report;
  const bool is_in_time = rest_.reply == nullptr && Clock::now() < late;
  report->has_room = report->is_complete || !is_bound || !is_in_time;
  if (report->is_complete) beside_ = area;
  return report;
}

// Beside what is followed and what is held of the area, none of which will go first.
std::uint64_t LinkFeed::MakeRoomBeside(TileStore& store,
                                       const MapArea& area,
                                       std::uint8_t finest) const {
  std::vector<TileId> kept = store.TilesIn(area, finest);
  Use(store, kept);
  const std::vector<TileId> followed = Followed(store, parts_);
  Use(store, followed);
  kept.insert(kept.end(), followed.begin(), followed.end());
  std::sort(kept.begin(), kept.end());
  kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
  const std::uint64_t room_bytes = store.RoomAmong(kept);
  const std::uint64_t left_bytes = room_bytes - std::min(room_bytes, store.BytesOf(kept));
  return left_bytes - left_bytes / kSpare;
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
