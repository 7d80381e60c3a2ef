#include "tests/bench/follow/first_map.h"

#include <algorithm>
#include <chrono>
#include <map>
#include <memory>
#include <utility>

#include "client/vehicle/atlas_view.h"
#include "core/planning/plan_route.h"

namespace atlas::testing {
namespace {

using Clock = std::chrono::steady_clock;

// What a view has of the finest level.
class HeldTiles : public TileSource {
 public:
  explicit HeldTiles(const MapAround& map) {
    for (const auto& tile : map.tiles) {
      if (tile->id.level == 0) tiles_[tile->id] = tile;
    }
  }
  Result<const Tile*> Get(const TileId& id) override {
    const auto found = tiles_.find(id);
    return found == tiles_.end() ? nullptr : found->second.get();
  }

 private:
  std::map<TileId, std::shared_ptr<const Tile>> tiles_;
};

bool IsIn(const TileId& id, const TileId& coarse) {
  const int levels = coarse.level - id.level;
  return levels >= 0 && id.x >> levels == coarse.x && id.y >> levels == coarse.y;
}

Result<std::vector<TileId>> FinestTiles(const FirstMapOptions& options) {
  ConnectionOptions connection;
  connection.endpoint = options.daemon;
  auto client = AtlasClient::Connect(connection);
  if (!client) return Error(client.error());
  RegionQuery query;
  query.disc = {options.place_m.head<2>(), options.radius_m};
  query.is_only_finest = true;
  std::vector<TileId> ids;
  const auto reply = client->QueryRegion(query, [&](const TileBlob& tile) {
    ids.push_back(tile.id);
    return Status();
  });
  if (!reply) return Error(reply.error());
  return ids;
}

class Vehicle {
 public:
  Vehicle(const FirstMapOptions& options, std::vector<TileId> finest)
      : options_(options),
        finest_(std::move(finest)),
        slow_(options.daemon, {.pace = options.link}) {}

  Result<FirstMap> Run() {
    LinkOptions link_options;
    link_options.connection.endpoint = slow_.endpoint();
    AtlasLink link(link_options);
    start_ = Clock::now();
    const auto client = link.Client(std::chrono::seconds(30));
    if (!client) return Error(client.error());
    first_.connected_s = Elapsed_s();
    const MapProfile profile = (*client)->profile();
    first_.complete_s.resize(profile.levels);
    first_.tiles.resize(profile.levels);
    first_.blob_bytes.resize(profile.levels);
    auto store = TileStore::Open({(*client)->atlas().atlas_id, profile}, {});
    if (!store) return Error(store.error());
    AtlasView view(*store, nullptr);
    SyncQuery query;
    query.area = DiscArea{options_.place_m.head<2>(), options_.radius_m};
    query.sections = options_.sections;
    const auto reply = (*client)->Sync(query, [&](const TileBlob& tile) {
      ATLAS_RETURN_IF_ERROR(store->Put(tile, {query.sections}));
      Count(tile);
      return Look(view, profile);
    });
    if (!reply) return Error(reply.error());
    return first_;
  }

 private:
  double Elapsed_s() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

  void Count(const TileBlob& tile) {
    first_.complete_s[tile.id.level] = Elapsed_s();
    ++first_.tiles[tile.id.level];
    first_.blob_bytes[tile.id.level] += tile.blob.size();
  }

  // As far as it has not seen all of it yet.
  Status Look(AtlasView& view, const MapProfile& profile) {
    if (first_.covered_s && first_.planned_s) return {};
    AroundOptions around;
    around.sections = options_.sections;
    const auto map = view.Around(options_.place_m.head<2>(), options_.radius_m, around);
    if (!map) return map.error();
    if (!first_.covered_s && Covers(*map)) {
      first_.covered_s = Elapsed_s();
      first_.covered_bytes = slow_.totals().bytes_down;
    }
    if (map->finest_places == last_finest_) return {};
    last_finest_ = map->finest_places;
    return Plan(*map, profile);
  }

  bool Covers(const MapAround& map) const {
    return std::all_of(finest_.begin(), finest_.end(), [&](const TileId& id) {
      return std::any_of(map.tiles.begin(), map.tiles.end(),
                         [&](const auto& tile) { return IsIn(id, tile->id); });
    });
  }

  Status Plan(const MapAround& map, const MapProfile& profile) {
    HeldTiles tiles(map);
    PlanRequest request;
    request.from = options_.place_m;
    request.to = options_.target_m;
    const auto route = PlanRoute(tiles, profile, request);
    if (!route && route.error().code() != StatusCode::kNotFound) return route.error();
    if (route && route->found && !first_.planned_s) first_.planned_s = Elapsed_s();
    return {};
  }

  const FirstMapOptions& options_;
  const std::vector<TileId> finest_;
  LinkProxy slow_;
  Clock::time_point start_;
  FirstMap first_;
  std::uint64_t last_finest_ = 0;
};

}  // namespace

Result<FirstMap> TimeFirstMap(const FirstMapOptions& options) {
  auto finest = FinestTiles(options);
  if (!finest) return Error(finest.error());
  return Vehicle(options, *std::move(finest)).Run();
}

}  // namespace atlas::testing
