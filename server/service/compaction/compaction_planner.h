// Which keyframes an atlas of preset bounded can do without: those that matter in no tile, each
// tile fused without them to be sure. The atlas may change meanwhile: a tile that did keeps all its
// keyframes. Reads and changes nothing; holds one tile at a time, and two numbers for each keyframe
// that may go. For one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "core/base/status.h"
#include "core/fusion/tile_fusion.h"
#include "server/service/fusion/stored_keyframes.h"
#include "server/store/atlas_store.h"

namespace atlas {

struct CompactionPlan {
  std::vector<std::int64_t> dropped;  // ids, ascending
  std::uint64_t tiles_checked = 0;    // that the dropped touch: without them as they are stored
};

class CompactionPlanner {
 public:
  struct Options {
    std::uint64_t revision = 0;                           // tiles reflect it, or changed since
    std::int64_t from_ms = 0;                             // keyframes before it stay
    std::int64_t before_ms = 0;                           // keyframes from then on stay
    std::size_t keyframe_bytes = std::size_t{128} << 20;  // decoded
    std::size_t tile_bytes = std::size_t{128} << 20;      // of the tile at hand
    // Asked before each keyframe; a failed status ends the work with it.
    std::function<Status()> check_stop;
  };

  CompactionPlanner(AtlasStore& store, Options options);

  // kInvalidData names what is damaged. Called again, what tiles that changed since the last time
  // leave of the plan.
  Result<CompactionPlan> Run();

 private:
  using Frames = std::vector<FrameOnMap>;

  Status VisitTiles(Status (CompactionPlanner::*visit)(const TileId& id, const Frames& frames));
  Status VisitTile(const TileId& id,
                   Status (CompactionPlanner::*visit)(const TileId& id, const Frames& frames));
  Result<bool> HasChanged(const TileId& id, std::uint64_t gathered_at);
  void KeepAll(const TileId& id, const Frames& frames);
  KeyframeSource SourceOf(const Frames& frames);
  bool MayGo(const FrameOnMap& frame) const;
  Status FindNeeded(const TileId& id, const Frames& frames);
  Status CheckWithout(const TileId& id, const Frames& frames);
  Result<bool> IsAsStored(const Tile& tile);

  AtlasStore& store_;
  const MapProfile profile_;
  const Options options_;
  KeyframeCache keyframes_;
  // By FrameOnMap::content.
  std::unordered_set<std::uint64_t> needed_;
  std::unordered_set<std::uint64_t> droppable_;
  // By tile key: how many of its keyframes were droppable when it was found to do without them.
  // They only get fewer: as many are the same.
  std::unordered_map<std::uint64_t, std::size_t> checked_;
  bool has_searched_ = false;  // all tiles for what they need
  bool is_settled_ = false;    // no tile of this round asked for keyframes back
};

}  // namespace atlas
