// What some sessions saw of a place, by themselves: their keyframes fused to tiles where somebody
// asks for one.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include "client/merge/plan/merge_session.h"
#include "client/merge/plan/submap_builder.h"
#include "core/base/lru_list.h"
#include "core/base/status.h"
#include "core/fusion/observation/frame_on_map.h"
#include "core/geometry/map_profile.h"
#include "core/geometry/tile_id.h"
#include "core/tile/tile.h"

namespace atlas {

// One thread at a time.
class FusedSide {
 public:
  // The profile outlives it.
  explicit FusedSide(const MapProfile& profile);

  // Keyframes of `session` at `T_world_sensor` of each, of which `is_near` (metres, world). `read`
  // outlives this. kInvalidData names a keyframe that is damaged or tilted by more than 2 degrees
  // against its grid; else errors are those of `read`.
  Status Add(const MergeSession& session,
             const std::vector<Pose>& T_world_sensor,
             const BlobReader& read,
             const std::function<bool(const Eigen::Vector3d&)>& is_near);

  std::set<TileId> Tiles() const;
  // Null where nothing was seen. Errors as Add.
  Result<std::shared_ptr<const Tile>> Fuse(const TileId& id);

 private:
  struct Frame {
    FrameOnMap on_map;
    const BlobReader* read = nullptr;
    std::size_t keyframe = 0;
  };

  Result<std::shared_ptr<const Keyframe>> Decode(std::size_t frame);

  const MapProfile& profile_;
  std::vector<Frame> frames_;
  std::map<TileId, std::vector<std::size_t>> frames_of_;  // that touch a tile
  LruList<std::shared_ptr<const Keyframe>> keyframes_;
  LruList<std::shared_ptr<const Tile>> tiles_;
};

}  // namespace atlas
