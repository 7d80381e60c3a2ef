// Where a planner gets tiles from: a client's cache, an atlas file, a test.
#pragma once

#include "core/base/status.h"
#include "core/geometry/tile_id.h"
#include "core/tile/tile.h"

namespace atlas {

class TileSource {
 public:
  virtual ~TileSource() = default;

  // Null where the atlas has no tile. The tile need only live until the next call. Errors are
  // handed on to whoever asked for the route.
  virtual Result<const Tile*> Get(const TileId& id) = 0;
};

}  // namespace atlas
