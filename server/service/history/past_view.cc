#include "server/service/history/past_view.h"

#include <utility>

#include "core/tile/tile_codec.h"

namespace atlas {

PastView::PastView(AtlasStore& store,
                   PastOptions options,
                   const RegionRequest& request,
                   std::size_t max_kept_bytes)
    : store_(store),
      tiles_(store, std::move(options)),
      request_(request),
      max_kept_bytes_(max_kept_bytes) {
  if (request_.disc) {
    request_.disc = ClampedToWorld(*request_.disc);
  }
}

Result<std::optional<StoredTile>> PastView::Read(const TileId& id) {
  if (auto kept = TakeKept(id)) {
    return kept;
  }
  const auto tile = tiles_.Build(id, [this, &id](const Tile& built) {
    if (built.id != id && IsAskedFor(built.id)) {
      Keep(built);
    }
    return Status();
  });
  if (!tile) {
    return Error(tile.error());
  }
  return tile->is_empty() ? std::nullopt : std::optional(Encoded(*tile));
}

bool PastView::IsAskedFor(const TileId& id) const {
  return id.level >= request_.finest_level &&
         (!request_.disc || SquaredDistance(*request_.disc, id, profile()));
}

StoredTile PastView::Encoded(const Tile& tile) const {
  EncodedTile encoded = EncodeTile(tile, profile());
  return {tile.id, tiles_.revision(), encoded.payload_hash, std::move(encoded.blob)};
}

void PastView::Keep(const Tile& tile) {
  if (kept_bytes_ >= max_kept_bytes_ || kept_.contains(tile.id)) {
    return;  // built again when its turn comes
  }
  StoredTile stored = Encoded(tile);
  kept_bytes_ += stored.blob.size();
  kept_.emplace(tile.id, std::move(stored));
}

std::optional<StoredTile> PastView::TakeKept(const TileId& id) {
  const auto found = kept_.find(id);
  if (found == kept_.end()) {
    return std::nullopt;
  }
  StoredTile tile = std::move(found->second);
  kept_bytes_ -= tile.blob.size();
  kept_.erase(found);
  return tile;
}

}  // namespace atlas
