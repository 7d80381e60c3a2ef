#include "client/map/map_view.h"

#include <algorithm>
#include <iterator>
#include <set>

#include "client/map/cell_address.h"
#include "core/base/str_cat.h"
#include "core/tile/tile_codec.h"

namespace atlas {

MapView::MapView(MapSource& source, const MapViewOptions& options)
    : source_(source), options_(options), cache_(options.max_cache_bytes) {}

Result<Tile> MapView::Decode(const TileBlob& read) const {
  Result<Tile> tile = DecodeTile(read.blob, profile());
  if (!tile) return Error(tile.error().WithContext(StrCat("tile ", read.id)));
  if (tile->id != read.id) {
    return Error(StatusCode::kInvalidData,
                 StrCat("tile ", read.id, ": the blob says it is ", tile->id));
  }
  return tile;
}

Status MapView::Fetch(std::uint8_t level, const DiscArea& disc, const OnDecoded& on_tile) {
  return source_.ReadLevel(level, disc, [&](const TileBlob& read) -> Status {
    Result<Tile> tile = Decode(read);
    if (!tile) return tile.error();
    ++tiles_loaded_;
    auto shared = std::make_shared<const Tile>(*std::move(tile));
    cache_.Put(read.id, shared);
    on_tile(shared);
    return {};
  });
}

Status MapView::ReadAll(std::uint8_t level, const std::function<void(const Tile&)>& on_tile) {
  return source_.ReadLevel(level, std::nullopt, [&](const TileBlob& read) -> Status {
    const Result<Tile> tile = Decode(read);
    if (!tile) return tile.error();
    on_tile(*tile);
    return {};
  });
}

Result<std::shared_ptr<const Tile>> MapView::FetchOne(const TileId& id) {
  // A disc in the middle of the tile touches no other.
  const DiscArea disc{TileCenter(id, profile()), 0.25 * TileSideMetres(id.level, profile())};
  std::shared_ptr<const Tile> fetched;
  const Status status = Fetch(id.level, disc, [&](const std::shared_ptr<const Tile>& tile) {
    if (tile->id == id) fetched = tile;
  });
  if (!status.ok()) return Error(status);
  if (fetched == nullptr) cache_.Put(id, nullptr);
  return fetched;
}

Result<std::shared_ptr<const Tile>> MapView::Get(const TileId& id) {
  if (auto known = cache_.Find(id)) return *std::move(known);
  return FetchOne(id);
}

Status MapView::FetchDisc(std::uint8_t level,
                          const DiscArea& disc,
                          const std::vector<TileId>& missing) {
  std::set<TileId> received;
  ATLAS_RETURN_IF_ERROR(Fetch(
      level, disc, [&](const std::shared_ptr<const Tile>& tile) { received.insert(tile->id); }));
  for (const TileId& id : missing) {
    if (!received.contains(id)) cache_.Put(id, nullptr);
  }
  return {};
}

Status MapView::Load(const Eigen::Vector2d& center_m, double radius_m, std::uint8_t level) {
  const auto tiles = TilesInDisc(center_m, radius_m, level, profile(), options_.max_tiles_per_load);
  if (!tiles) return tiles.error();
  std::vector<TileId> missing;
  std::copy_if(tiles->begin(), tiles->end(), std::back_inserter(missing),
               [this](const TileId& id) { return !cache_.Contains(id); });
  // One reading of the disc brings again what is held: worth it only when little is.
  if (2 * missing.size() > tiles->size()) {
    return FetchDisc(level, {center_m, radius_m}, missing);
  }
  for (const TileId& id : missing) {
    if (const auto tile = FetchOne(id); !tile) return tile.error();
  }
  return {};
}

Result<std::vector<TileLayer>> MapView::LayersAt(const Eigen::Vector2d& p_m, std::uint8_t level) {
  const auto address = LocateCell(p_m, level, profile());
  if (!address) return Error(address.error());
  const auto tile = Get(address->tile);
  if (!tile) return Error(tile.error());
  if (*tile == nullptr) return std::vector<TileLayer>();
  const auto layers = (*tile)->Layers(address->cell);
  return std::vector<TileLayer>(layers.begin(), layers.end());
}

}  // namespace atlas
