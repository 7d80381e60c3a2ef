// Makes one tile from what the store holds: level 0 from keyframes, the others from their children.
// Used by the workers and, with caches of its own, by verification. Thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/base/status.h"
#include "core/fusion/sigma_table.h"
#include "core/fusion/tile_fusion.h"
#include "core/tile/tile.h"
#include "server/service/keyframe_cache.h"
#include "server/service/survey_cache.h"
#include "server/store/atlas_store.h"

namespace atlas {

struct BuiltTile {
  std::uint64_t revision = 0;          // the tile reflects every change up to it
  std::optional<TileContent> content;  // none: no cell has a layer
};

struct TileBuilderOptions {
  std::size_t keyframe_bytes = std::size_t{128} << 20;  // decoded keyframes, all workers together
  SurveyCacheLimits surveys;                            // kept from one fusion to the next
  std::size_t tile_bytes = std::size_t{128} << 20;      // surveys of the tile at hand, a worker
};

class TileBuilder {
 public:
  TileBuilder(AtlasStore& store, const TileBuilderOptions& options);

  // kInvalidData names the damaged keyframe, pose or child tile.
  Result<BuiltTile> Build(const TileId& id);

 private:
  Result<BuiltTile> BuildFromKeyframes(const TileId& id);
  Result<BuiltTile> BuildFromChildren(const TileId& id);
  Result<Tile> Fuse(const TileId& id,
                    std::span<const FrameOnMap> frames,
                    const KeyframeSource& source);
  bool FitsInMemory(const TileId& id, std::span<const FrameOnMap> frames) const;
  Result<Keyframe> LoadKeyframe(std::int64_t id) const;

  AtlasStore& store_;
  const MapProfile profile_;
  const SigmaTable sigmas_;
  TileBuilderOptions options_;
  KeyframeCache keyframes_;
  SurveyCache surveys_;
};

}  // namespace atlas
