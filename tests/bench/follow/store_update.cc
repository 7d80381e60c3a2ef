#include "tests/bench/follow/store_update.h"

#include <map>
#include <utility>
#include <vector>

#include "client/connection/atlas_client.h"
#include "client/vehicle/store_sync.h"
#include "client/vehicle/tile_store.h"

namespace atlas::testing {
namespace {

std::map<TileId, std::uint64_t> Hashes(const TileStore& store) {
  std::map<TileId, std::uint64_t> hashes;
  for (const TileId& id : store.Tiles()) {
    hashes.emplace(id, store.Find(id)->payload_hash);
  }
  return hashes;
}

Result<TileStore> OpenStore(const AtlasClient& client, const std::string& folder) {
  TileStoreOptions options;
  options.folder = folder;
  return TileStore::Open({client.atlas().atlas_id, client.profile()}, options);
}

Result<StoreSyncReport> Sync(AtlasClient& client, TileStore& store, MapArea area) {
  SyncQuery query;
  query.area = std::move(area);
  query.timeout = std::chrono::minutes(5);
  auto report = SyncStore(client, store, std::move(query));
  if (report && !report->is_complete) {
    return Error(StatusCode::kTimeout, "not everything came");
  }
  return report;
}

}  // namespace

Result<StoreUpdate> UpdateStore(const Endpoint& daemon,
                                const BoxArea& area,
                                const std::string& folder) {
  ConnectionOptions options;
  options.endpoint = daemon;
  auto client = AtlasClient::Connect(options);
  if (!client) return Error(client.error());
  auto held = OpenStore(*client, folder);
  if (!held) return Error(held.error());
  auto nothing = OpenStore(*client, "");
  if (!nothing) return Error(nothing.error());

  const auto before = Hashes(*held);
  const auto update = Sync(*client, *held, area);
  if (!update) return Error(update.error());
  TilesArea changed;
  for (const auto& [id, hash] : Hashes(*held)) {
    const auto was = before.find(id);
    if (was == before.end() || was->second != hash) {
      changed.ids.push_back(id);
    }
  }
  const auto whole = Sync(*client, *nothing, changed);
  if (!whole) return Error(whole.error());
  return StoreUpdate{changed.ids.size(), update->deltas, update->bytes, whole->bytes};
}

}  // namespace atlas::testing
