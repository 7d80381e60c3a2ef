#include "client/onboard/held_tiles.h"

#include <memory>
#include <utility>

#include "core/tile/tile_codec.h"

namespace atlas {

Result<const Tile*> HeldTiles::Get(const TileId& id) {
  const Tile* none = nullptr;
  if (store_.Find(id) == nullptr) {
    ++not_held_;
    return none;
  }
  const Result<std::shared_ptr<const Bytes>> blob = store_.Read(id);
  if (!blob) {
    if (store_.Find(id) != nullptr) return Error(blob.error());
    ++not_held_;
    return none;
  }
  Result<Tile> tile = DecodeTile(**blob, store_.atlas().profile);
  if (!tile) {
    store_.Remove(id);
    ++not_held_;
    return none;
  }
  lent_ = *std::move(tile);
  return &lent_;
}

}  // namespace atlas
