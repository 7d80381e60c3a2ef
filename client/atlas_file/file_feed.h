// A vehicle's tile store filled from an atlas file: the map around a pose without a daemon, or all
// of an atlas taken along before the first drive.
#pragma once

#include "client/atlas_file/atlas_file.h"
#include "client/vehicle/tile_feed.h"

namespace atlas {

class FileFeed final : public TileFeed {
 public:
  // The file outlives the feed.
  explicit FileFeed(AtlasFile& file) : file_(file) {}

  // In the area the store becomes what the file has, the coarsest level first: what the file holds
  // otherwise is replaced, what it has not is removed. Tiles come with all their sections; the
  // budget counts their blobs. kConflict: the file is of another atlas. kInvalidData names the
  // first damaged tile, after all others came. Else errors as of AtlasFile.
  Result<StoreSyncReport> Sync(TileStore& store,
                               const MapArea& area,
                               const AroundOptions& options) override;

 private:
  AtlasFile& file_;
};

}  // namespace atlas
