// The rules of docs/algorithms/fusion.md written down a second time, as plainly as they read and in
// one batch: the oracle that the product is compared with, field by field and in speed. Shares with
// it only tables (SigmaTable, OverlapsAsOneLayer, nibbles), integer arithmetic, where a column
// begins, and types. Changes only when the rules do.
#pragma once

#include <span>

#include "core/fusion/tile_fusion.h"

namespace atlas::testing {

Tile PlainFuseTile(const TileId& id,
                   std::span<const PlacedKeyframe> keyframes,
                   const MapProfile& profile);

}  // namespace atlas::testing
