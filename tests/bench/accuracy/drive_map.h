// A simulated drive through the product's own front end and fusion: the map to be judged.
#pragma once

#include <cstddef>
#include <span>
#include <unordered_map>
#include <vector>

#include "core/base/status.h"
#include "core/fusion/tile_fusion.h"
#include "core/geometry/map_profile.h"
#include "core/keyframe/keyframe_builder.h"
#include "core/simulation/simulated_drive.h"
#include "core/tile/tile.h"
#include "tests/bench/accuracy/map_cell.h"

namespace atlas::testing {

// Rings, layout and sensor height are found in scans [begin, end) as when a recorded drive is
// ingested.
Result<KeyframeBuilder> FindBuilder(const SimulatedDrive& drive,
                                    std::size_t begin,
                                    std::size_t end,
                                    const MapProfile& profile,
                                    double range_m);
Keyframe BuildKeyframe(const KeyframeBuilder& builder, const SimulatedDrive& drive, std::size_t i);

// Scans [begin, end) as keyframes. A jump begins another session.
Result<std::vector<PlacedKeyframe>> BuildKeyframes(const SimulatedDrive& drive,
                                                   std::size_t begin,
                                                   std::size_t end,
                                                   const MapProfile& profile,
                                                   double range_m);

class DriveMap {
 public:
  DriveMap(const std::vector<PlacedKeyframe>& keyframes, const MapProfile& profile);

  // Of the finest level; null where nobody was.
  const Tile* Find(const TileId& id) const;
  std::span<const TileLayer> Layers(const MapCell& cell) const;
  const MapProfile& profile() const { return profile_; }

 private:
  MapProfile profile_;
  std::unordered_map<std::uint64_t, Tile> tiles_;  // by TileId::Key()
};

}  // namespace atlas::testing
