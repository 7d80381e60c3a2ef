// The rules of docs/algorithms/fusion.md written down a second time, as slowly and plainly as they
// read: the oracle of the property tests. Shares with the product only its tables (SigmaTable,
// OverlapsAsOneLayer, nibbles) and its types.
#pragma once

#include <span>

#include "core/fusion/tile_fusion.h"

namespace atlas::testing {

// Presets strict and bounded.
Tile ReferenceFuseTile(const TileId& id,
                       std::span<const PlacedKeyframe> keyframes,
                       const MapProfile& profile);

}  // namespace atlas::testing
