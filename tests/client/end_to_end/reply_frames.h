// What a daemon sent on a connection, taken apart: frames in their order, and the tiles in them.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/bytes.h"
#include "core/geometry/tile_id.h"

namespace atlas {

struct ReplyFrames {
  std::vector<std::int64_t> ends;    // of each frame, in bytes from the first one's start
  std::vector<std::size_t> arrived;  // tiles that came with it and before it
  std::vector<TileId> tiles;
  std::vector<TileId> announced;  // by all manifests
  std::uint64_t removed = 0;      // named in manifests
  std::uint64_t differing = 0;    // blocks
};

// Throws when it is not whole frames.
ReplyFrames TakeApart(const Bytes& sent);

}  // namespace atlas
