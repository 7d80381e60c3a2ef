// Random but valid tiles.
#pragma once

#include <algorithm>
#include <cstdint>
#include <random>
#include <string>

#include "core/tile/tile.h"

namespace atlas::testing {

inline TileLayer RandomLayer(const MapProfile& profile, std::mt19937& random) {
  TileLayer layer;
  layer.altitude_mm = static_cast<std::int32_t>(random() % 40'000) - 20'000;
  layer.sigma_100um = static_cast<std::uint16_t>(1 + random() % 65'535);
  layer.occupancy = static_cast<std::int8_t>(static_cast<int>(random() % 129) - 64);
  layer.flags = random() & 7;
  layer.observations = static_cast<std::uint16_t>(random());
  const std::uint64_t mask = ~std::uint64_t{0} >> (64u - 4u * profile.column_segments);
  const std::uint64_t bits = (std::uint64_t{random()} << 32) | random();
  layer.column = random() % 2 == 0 ? bits & mask : 0;
  return layer;
}

inline Tile RandomTile(const TileId& id, const MapProfile& profile, std::uint32_t seed) {
  std::mt19937 random(seed);
  Tile tile = EmptyTile(id, profile);
  for (std::size_t cell = 0; cell + 1 < tile.cell_begin.size(); ++cell) {
    const std::size_t count = random() % 16 == 0 ? random() % (kMaxCellLayers + 1) : random() % 3;
    for (std::size_t i = 0; i < count; ++i) {
      tile.layers.push_back(RandomLayer(profile, random));
    }
    std::sort(tile.layers.end() - static_cast<std::ptrdiff_t>(count), tile.layers.end(),
              [](const auto& a, const auto& b) { return a.altitude_mm < b.altitude_mm; });
    tile.cell_begin[cell + 1] = static_cast<std::uint32_t>(tile.layers.size());
  }
  for (std::uint32_t i = 0; i < 1 + seed % 3; ++i) {
    tile.contributors.push_back({"car", "drive" + std::to_string(i)});
  }
  return tile;
}

}  // namespace atlas::testing
