// The atlas as a vehicle sees it: tiles come from a source when they are first asked for and are
// kept in a bounded cache. What was loaded stays as it was until Forget.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "client/map/map_source.h"
#include "client/map/tile_cache.h"
#include "core/base/status.h"
#include "core/tile/tile.h"

namespace atlas {

struct MapViewOptions {
  std::size_t max_cache_bytes = std::size_t{256} << 20;
  std::size_t max_tiles_per_load = 16'384;
};

class MapView {
 public:
  // The source outlives the view.
  explicit MapView(MapSource& source, const MapViewOptions& options = {});

  const MapProfile& profile() const { return source_.profile(); }

  // Each fails as its source does, and with kInvalidData on a blob that is not the tile it should
  // be.
  //
  // Null where the atlas has no tile.
  Result<std::shared_ptr<const Tile>> Get(const TileId& id);
  // Makes sure that the tiles of `level` that the disc touches are known.
  Status Load(const Eigen::Vector2d& center_m, double radius_m, std::uint8_t level);
  // Calls back once for every tile of `level`, in any order, and keeps none.
  Status ReadAll(std::uint8_t level, const std::function<void(const Tile&)>& on_tile);
  // The layers of the cell that holds the place, lowest first; empty where there is none.
  Result<std::vector<TileLayer>> LayersAt(const Eigen::Vector2d& p_m, std::uint8_t level = 0);
  void Forget() { cache_.Clear(); }

  std::uint64_t tiles_loaded() const { return tiles_loaded_; }

 private:
  using OnDecoded = std::function<void(const std::shared_ptr<const Tile>&)>;

  Result<Tile> Decode(const TileBlob& read) const;
  Status Fetch(std::uint8_t level, const DiscArea& disc, const OnDecoded& on_tile);
  Result<std::shared_ptr<const Tile>> FetchOne(const TileId& id);
  Status FetchDisc(std::uint8_t level, const DiscArea& disc, const std::vector<TileId>& missing);

  MapSource& source_;
  MapViewOptions options_;
  TileCache cache_;
  std::uint64_t tiles_loaded_ = 0;
};

}  // namespace atlas
