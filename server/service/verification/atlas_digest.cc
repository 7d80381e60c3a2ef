#include "server/service/verification/atlas_digest.h"

#include "core/base/str_cat.h"
#include "core/tile/tile_codec.h"
#include "server/store/tile_hasher.h"

namespace atlas {
namespace {

constexpr std::uint32_t kPage = 1'024;

Status AddTile(AtlasStore& store, const TileId& id, TileHasher& hasher) {
  const auto tile = store.ReadTile(id);
  if (!tile) {
    return tile.error();
  }
  if (!*tile) {  // gone since it was listed
    return {};
  }
  const auto payload = TilePayloadFromBlob((*tile)->blob);
  if (!payload) {
    return payload.error().WithContext(StrCat("tile ", id));
  }
  hasher.Add(id, *payload);
  return {};
}

}  // namespace

Result<AtlasDigest> ComputeDigest(AtlasStore& store, const std::function<Status()>& check_stop) {
  TileHasher hasher;
  std::int64_t after = -1;
  while (true) {
    const auto page = store.ListTiles(after, kPage);
    if (!page) {
      return Error(page.error());
    }
    if (page->empty()) {
      break;
    }
    for (const TileSummary& tile : *page) {
      if (Status status = check_stop(); !status.ok()) {
        return Error(std::move(status));
      }
      if (Status status = AddTile(store, tile.id, hasher); !status.ok()) {
        return Error(std::move(status));
      }
    }
    after = static_cast<std::int64_t>(page->back().id.Key());
  }
  const auto sha256 = hasher.Finish();
  if (!sha256) {
    return Error(sha256.error());
  }
  return AtlasDigest{*sha256, hasher.tiles(), 0};
}

}  // namespace atlas
