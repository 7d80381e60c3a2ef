// The tiles of a sync's reply as they go out: ready in memory, from the store, or made into deltas
// to what the peer holds.
#pragma once

#include <memory>
#include <optional>

#include "core/base/status.h"
#include "proto/wire/tile_body.h"
#include "server/net/requests/tile_frames.h"
#include "server/service/atlas_service.h"

namespace atlas {

class ReplyTiles {
 public:
  using Body = std::shared_ptr<const TileBody>;

  // Both outlive this.
  ReplyTiles(AtlasService& service, TileFrames& frames) : service_(service), frames_(frames) {}

  // One that the plan of `request` has. Null: it is gone by now, or damaged. nullopt: it takes the
  // disk or long, and `may_block` is false. A delta only where that is smaller, and against a
  // content that was sent from memory lately.
  Result<std::optional<Body>> Find(const SyncRequest& request,
                                   const SyncItem& item,
                                   bool takes_deltas,
                                   bool may_block);

 private:
  Body FindReady(const TileFrames::Content& content, std::uint64_t revision);
  Body FindBase(const SyncItem& item, SectionMask wanted);
  Result<Body> Read(const SyncRequest& request, const SyncItem& item);
  Result<Body> MakeBest(const TileFrames::Content& content,
                        const TileBody& base,
                        const Body& whole);

  AtlasService& service_;
  TileFrames& frames_;
};

}  // namespace atlas
