// Tiles of very different sizes, for what a small store does with them.
#pragma once

#include <cstdint>
#include <random>

#include "tests/client/vehicle/sync_peer.h"

namespace atlas {

// Several surfaces above each other, as rough as no road: many times the bytes of TinyWorld::Set.
inline Tile DenseTile(std::int32_t x, std::int32_t y) {
  constexpr int kSurfaces = 6;
  Tile tile = EmptyTile({0, x, y}, TinyProfile());
  tile.contributors = {{"car", "monday"}};
  std::mt19937 random(static_cast<std::uint32_t>(1'000 * x + y));
  for (std::size_t cell = 0; cell + 1 < tile.cell_begin.size(); ++cell) {
    for (int surface = 0; surface < kSurfaces; ++surface) {
      TileLayer layer;
      layer.altitude_mm = 10'000 * surface + static_cast<std::int32_t>(random() % 400);
      layer.sigma_100um = 1'000;
      layer.observations = 3;
      tile.layers.push_back(layer);
    }
    tile.cell_begin[cell + 1] = static_cast<std::uint32_t>(tile.layers.size());
  }
  return tile;
}

}  // namespace atlas
