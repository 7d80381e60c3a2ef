#include "tests/client/vehicle/tiny_world.h"

#include <array>

#include "core/tile/tile_pyramid.h"

namespace atlas {

MapProfile TinyProfile() {
  MapProfile profile;
  profile.tile_cells = 16;
  profile.levels = 4;
  return profile;
}

AtlasKey TinyAtlas() {
  return {Bytes(16, 'a'), TinyProfile()};
}

void TinyWorld::Set(std::int32_t x, std::int32_t y, std::int32_t altitude_mm) {
  Tile tile = EmptyTile({0, x, y}, TinyProfile());
  tile.contributors = {{"car", "monday"}};
  TileLayer layer;
  layer.altitude_mm = altitude_mm;
  layer.sigma_100um = 1'000;
  layer.observations = 3;
  for (std::size_t cell = 0; cell + 1 < tile.cell_begin.size(); ++cell) {
    layer.altitude_mm += 10;
    tile.layers.push_back(layer);
    tile.cell_begin[cell + 1] = static_cast<std::uint32_t>(cell + 1);
  }
  Put(tile);
}

void TinyWorld::Erase(std::int32_t x, std::int32_t y) {
  ++revision_;
  decoded_.erase({0, x, y});
  tiles_.erase({0, x, y});
  BuildParents({0, x, y});
}

void TinyWorld::Store(const Tile& tile) {
  EncodedTile encoded = EncodeTile(tile, TinyProfile());
  Stored& stored = tiles_[tile.id];
  if (stored.encoded.payload_hash == encoded.payload_hash) return;
  past_blobs_[encoded.payload_hash] = encoded.blob;
  stored = {revision_, std::move(encoded)};
  decoded_[tile.id] = tile;
}

void TinyWorld::BuildParents(TileId id) {
  while (id.level + 1 < TinyProfile().levels) {
    id = id.Parent();
    std::array<const Tile*, 4> children{};
    for (std::size_t i = 0; i < children.size(); ++i) {
      const auto found = decoded_.find(id.Children()[i]);
      children[i] = found == decoded_.end() ? nullptr : &found->second;
    }
    const Tile parent = BuildParentTile(id, children, TinyProfile());
    if (!parent.is_empty()) {
      Store(parent);
    } else {
      decoded_.erase(id);
      tiles_.erase(id);
    }
  }
}

void TinyWorld::ChangeSome(std::mt19937& random, int side, int changes) {
  for (int i = 0; i < changes; ++i) {
    const int x = static_cast<int>(random() % static_cast<unsigned>(side)) - side / 2;
    const int y = static_cast<int>(random() % static_cast<unsigned>(side)) - side / 2;
    if (random() % 4 == 0) {
      Erase(x, y);
    } else {
      Set(x, y, static_cast<std::int32_t>(random() % 4'000));
    }
  }
}

TinyWorld SquareWorld(int side) {
  TinyWorld world;
  for (int x = 0; x < side; ++x) {
    for (int y = 0; y < side; ++y) {
      world.Set(x, y, 100 * x + y);
    }
  }
  return world;
}

}  // namespace atlas
