#include "client/vehicle/atlas_view.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>

#include "client/map/tile_cache.h"
#include "client/vehicle/area_touch.h"
#include "client/vehicle/link_feed.h"
#include "core/base/str_cat.h"
#include "core/tile/tile_codec.h"

namespace atlas {
namespace {

constexpr SectionBits kNeeded = SectionBits{1}
                                    << static_cast<unsigned>(TileSection::kContributors) |
                                SectionBits{1} << static_cast<unsigned>(TileSection::kSurface);

Status CheckOptions(const AroundOptions& options, const MapProfile& profile) {
  if ((options.sections & kNeeded) != kNeeded) {
    return {StatusCode::kInvalidArgument,
            "atlas view: expected contributors and surface among the sections"};
  }
  if (options.finest_level >= profile.levels) {
    return {StatusCode::kInvalidArgument, StrCat("atlas view: level ", int{options.finest_level},
                                                 ", the atlas has ", int{profile.levels})};
  }
  return {};
}

Status CheckDisc(const DiscArea& disc) {
  const bool is_disc = disc.center_m.allFinite() && disc.radius_m >= 0.0 && disc.radius_m <= 1e7;
  return is_disc ? Status()
                 : Status(StatusCode::kInvalidArgument,
                          "atlas view: expected a place and a radius of 0 to 10000 km");
}

// Whether there is a layer in each quarter of the tile, in the order of TileId::Children: where
// there is one, the child below exists.
std::array<bool, 4> QuartersWithLayers(const Tile& tile, const MapProfile& profile) {
  std::array<bool, 4> quarters{};
  const std::size_t side = profile.tile_cells;
  for (std::size_t cell = 0; cell < side * side; ++cell) {
    const std::size_t right = cell % side >= side / 2 ? 1 : 0;
    const std::size_t upper = cell / side >= side / 2 ? 2 : 0;
    quarters[right + upper] |= tile.cell_begin[cell + 1] > tile.cell_begin[cell];
  }
  return quarters;
}

}  // namespace

AtlasView::AtlasView(TileStore& store, AtlasLink* link, std::size_t max_decoded_bytes)
    : store_(store),
      own_feed_(std::make_unique<LinkFeed>(link)),
      feed_(own_feed_.get()),
      max_decoded_bytes_(max_decoded_bytes) {}

AtlasView::AtlasView(TileStore& store, TileFeed& feed, std::size_t max_decoded_bytes)
    : store_(store), feed_(&feed), max_decoded_bytes_(max_decoded_bytes) {}

Result<std::shared_ptr<const Tile>> AtlasView::Decode(const TileId& id) {
  const TileFacts* facts = store_.Find(id);
  if (facts == nullptr) return Error(StatusCode::kNotFound, StrCat("tile ", id, ": not held"));
  const Decoded* known = decoded_.Use(id.Key());
  if (known != nullptr && known->payload_hash == facts->payload_hash &&
      known->sections == facts->sections) {
    store_.Use(id);
    return known->tile;
  }
  Decoded fresh{facts->payload_hash, facts->sections, nullptr};
  const Result<std::shared_ptr<const Bytes>> blob = store_.Read(id);
  if (!blob) return Error(blob.error());
  Result<Tile> tile = DecodeTile(**blob, store_.atlas().profile);
  if (!tile) {
    store_.Remove(id);
    return Error(tile.error());
  }
  fresh.tile = std::make_shared<const Tile>(*std::move(tile));
  decoded_.Insert(id.Key(), fresh, MemoryBytes(*fresh.tile));
  while (decoded_.TakeOldestAbove(max_decoded_bytes_)) {
  }
  return fresh.tile;
}

std::uint64_t AtlasView::MissingBelow(const Tile& tile,
                                      const DiscArea& disc,
                                      const std::set<TileId>& unread) const {
  const MapProfile& profile = store_.atlas().profile;
  const auto quarters = QuartersWithLayers(tile, profile);
  const auto children = tile.id.Children();
  std::uint64_t missing = 0;
  for (std::size_t i = 0; i < children.size(); ++i) {
    const bool is_wanted = quarters[i] && Touches(disc, children[i], profile);
    const bool is_there = store_.Find(children[i]) != nullptr && !unread.contains(children[i]);
    missing += is_wanted && !is_there ? 1U : 0U;
  }
  return missing;
}

bool AtlasView::Collect(const DiscArea& disc, const AroundOptions& options, MapAround& map) {
  map.tiles.clear();
  map.finest_places = 0;
  map.coarse_places = 0;
  map.disk = Status();
  std::set<TileId> unread;
  std::vector<TileId> ids = store_.TilesIn(disc, options.finest_level);
  // Finest first, so that a tile found damaged is missing when its parent is looked at.
  for (const TileId& id : ids) {
    const Result<std::shared_ptr<const Tile>> tile = Decode(id);
    if (!tile && store_.Find(id) == nullptr) return false;
    if (!tile) {
      unread.insert(id);
      if (map.disk.ok()) map.disk = tile.error();
      continue;
    }
    const bool is_finest = id.level == options.finest_level;
    const std::uint64_t missing = is_finest ? 0 : MissingBelow(**tile, disc, unread);
    if (!is_finest && missing == 0) continue;
    map.finest_places += is_finest ? 1U : 0U;
    map.coarse_places += missing;
    map.tiles.push_back(*tile);
  }
  map.is_current = map.is_current && map.disk.ok();
  std::reverse(map.tiles.begin(), map.tiles.end());
  return true;
}

void AtlasView::NoteSync(const Result<StoreSyncReport>& synced, MapAround& map) const {
  map.sync = synced ? Status() : synced.error();
  map.is_current = synced && synced->is_complete && synced->has_room;
  if (!synced) return;
  if (!synced->has_room) {
    map.sync = Status(StatusCode::kResourceExhausted,
                      "tile store: no room for the map around, whose finest levels are followed "
                      "nearby only: max_disk_bytes or max_memory_bytes is too small");
  }
  map.revision = synced->revision;
  map.transfer.tiles += synced->tiles;
  map.transfer.bytes += synced->bytes;
  map.transfer.requests += synced->requests;
  map.transfer.revision = synced->revision;
  map.transfer.is_complete = synced->is_complete;
}

void AtlasView::NoteDropped(const DiscArea& disc, std::uint8_t finest, MapAround& map) {
  const std::vector<TileId> dropped = store_.TakeDropped();
  feed_->NoteDropped(store_, dropped);
  const auto is_missing = [&](const TileId& id) {
    return id.level >= finest && Touches(disc, id, store_.atlas().profile) &&
           store_.Find(id) == nullptr;
  };
  const auto missing = std::count_if(dropped.begin(), dropped.end(), is_missing);
  if (missing == 0) return;
  map.is_current = false;
  if (map.sync.ok()) {
    map.sync = Status(StatusCode::kResourceExhausted,
                      StrCat("tile store: no room for ", missing, " tiles of the map around: ",
                             "max_disk_bytes or max_memory_bytes is too small"));
  }
}

Result<MapAround> AtlasView::Around(const Eigen::Vector2d& position_m,
                                    double radius_m,
                                    const AroundOptions& options) {
  const DiscArea disc{position_m, radius_m};
  Status status = CheckOptions(options, store_.atlas().profile);
  if (status.ok()) status = CheckDisc(disc);
  if (!status.ok()) return Error(std::move(status));
  using Clock = std::chrono::steady_clock;
  const Clock::time_point end = Clock::now() + options.deadline;
  MapAround map;
  store_.TakeDropped();
  NoteSync(feed_->Sync(store_, disc, options), map);
  // Each tile that was damaged on disk is gone after the pass that met it.
  bool is_damaged = false;
  while (!Collect(disc, options, map)) {
    is_damaged = true;
  }
  NoteDropped(disc, options.finest_level, map);
  if (!is_damaged || !map.sync.ok()) return map;
  AroundOptions rest = options;
  rest.deadline = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now());
  if (rest.deadline.count() <= 0) {
    map.is_current = false;
    return map;
  }
  if (rest.budget_bytes != 0) {
    rest.budget_bytes -= std::min(rest.budget_bytes, map.transfer.bytes);
    map.is_current = false;
    if (rest.budget_bytes == 0) return map;
  }
  NoteSync(feed_->Sync(store_, disc, rest), map);
  while (!Collect(disc, options, map)) {
    map.is_current = false;
  }
  NoteDropped(disc, options.finest_level, map);
  return map;
}

Result<StoreSyncReport> AtlasView::Prefetch(const std::vector<Eigen::Vector2d>& route_m,
                                            double half_width_m,
                                            const AroundOptions& options) {
  if (Status status = CheckOptions(options, store_.atlas().profile); !status.ok()) {
    return Error(std::move(status));
  }
  const MapArea route = CorridorArea{route_m, half_width_m};
  store_.TakeDropped();
  Result<StoreSyncReport> report = feed_->Sync(store_, route, options);
  if (!report) return report;
  const std::vector<TileId> dropped = store_.TakeDropped();
  report->has_room &= std::none_of(dropped.begin(), dropped.end(), [&](const TileId& id) {
    return id.level >= options.finest_level && Touches(route, id, store_.atlas().profile) &&
           store_.Find(id) == nullptr;
  });
  if (!report->has_room) {
    report->sync = Status(StatusCode::kResourceExhausted,
                          "tile store: no room for all of the route beside the map around: "
                          "max_disk_bytes or max_memory_bytes is too small");
  }
  return report;
}

}  // namespace atlas
