// Flat decks seen from above: worlds whose map is known by heart.
#pragma once

#include <utility>
#include <vector>

#include "core/fusion/tile_fusion.h"
#include "tests/core/support/keyframe_worlds.h"

namespace atlas::testing {

inline MapProfile SmallProfile() {
  MapProfile profile;
  profile.tile_cells = 16;
  return profile;
}

// A flat deck around a sensor 2 m above it.
struct Deck {
  double z_m = 0.0;  // of the deck
  Occupancy occupancy = Occupancy::kFree;
  AltitudeSource source = AltitudeSource::kMeasured;
  std::uint64_t column = 0;  // from the segment of the deck upwards: anchor -2
  double x_m = 0.8;          // of the sensor; the tile covers 0 .. 1.6 m
  double y_m = 0.8;
  std::int32_t radius_cells = 16;
};

inline PlacedKeyframe See(const Deck& deck, const FrameName& name) {
  Keyframe keyframe = BlankKeyframe(SmallProfile(), deck.radius_cells);
  FillDisc(keyframe, {-2'000, deck.occupancy, deck.source}, deck.column);
  keyframe.anchors.assign(keyframe.anchors.size(), -2);
  return PlacedFrame(name, {deck.x_m, deck.y_m, deck.z_m + 2.0}, std::move(keyframe));
}

inline Tile Fuse(const std::vector<PlacedKeyframe>& keyframes) {
  return FuseTile({0, 0, 0}, keyframes, SmallProfile());
}

// The layers of the cell at the tile's middle.
inline std::vector<TileLayer> Middle(const std::vector<PlacedKeyframe>& keyframes) {
  const Tile tile = Fuse(keyframes);
  const auto layers = tile.Layers(8 * 16 + 8);
  return {layers.begin(), layers.end()};
}

}  // namespace atlas::testing
