#include "core/localization/places/block_map.h"

#include <algorithm>
#include <cmath>

#include "core/base/integer_math.h"
#include "core/geometry/nibble.h"

namespace atlas {
namespace {

// Segments below the first column that a chunk gets to know; above there are 32. What is beyond is
// left out: hills within 26 m.
constexpr std::int64_t kBelow = 31;

}  // namespace

BlockMap::BlockMap(const MapProfile& profile, double block_m, std::uint8_t occupied_nibble)
    : profile_(profile),
      occupied_nibble_(occupied_nibble),
      block_cells_(std::max<std::int64_t>(1, std::llround(block_m / profile.cell_size_m()))),
      block_m_(static_cast<double>(block_cells_) * profile.cell_size_m()),
      segment_m_(profile.segment_height_m()) {}

void BlockMap::Add(const Tile& tile) {
  if (tile.id.level != 0) {
    return;
  }
  const std::int64_t first_x = std::int64_t{tile.id.x} * profile_.tile_cells;
  const std::int64_t first_y = std::int64_t{tile.id.y} * profile_.tile_cells;
  for (std::int64_t j = 0; j < profile_.tile_cells; ++j) {
    for (std::int64_t i = 0; i < profile_.tile_cells; ++i) {
      for (const TileLayer& layer :
           tile.Layers(static_cast<std::size_t>(j * profile_.tile_cells + i))) {
        AddColumn(layer, FloorDiv(first_x + i, block_cells_), FloorDiv(first_y + j, block_cells_));
      }
    }
  }
}

void BlockMap::AddColumn(const TileLayer& layer, std::int64_t block_x, std::int64_t block_y) {
  const std::int64_t lowest = ColumnBaseIndex(layer.altitude_mm, profile_);
  std::uint64_t occupied = 0;
  for (int k = 0; k < profile_.column_segments; ++k) {
    occupied |= std::uint64_t{NibbleAt(layer.column, k) >= occupied_nibble_ ? 1U : 0U} << k;
  }
  if (occupied == 0) {
    return;
  }
  Mark(&Chunk::occupied, block_x, block_y, occupied, lowest);
  for (std::int64_t j = -1; j <= 1; ++j) {
    for (std::int64_t i = -1; i <= 1; ++i) {
      Mark(&Chunk::near, block_x + i, block_y + j, occupied, lowest);
    }
  }
}

void BlockMap::Mark(std::array<std::uint64_t, kSide * kSide> Chunk::*masks,
                    std::int64_t block_x,
                    std::int64_t block_y,
                    std::uint64_t segments,
                    std::int64_t lowest) {
  const Key key{FloorDiv(block_x, kSide), FloorDiv(block_y, kSide)};
  Chunk& chunk = ChunkOf(key, lowest);
  const std::int64_t shift = lowest - chunk.base;
  if (shift > -64 && shift < 64) {
    (chunk.*masks)[static_cast<std::size_t>((block_y - key.y * kSide) * kSide + block_x -
                                            key.x * kSide)] |=
        shift >= 0 ? segments << shift : segments >> -shift;
  }
}

BlockMap::Chunk& BlockMap::ChunkOf(const Key& key, std::int64_t lowest) {
  std::unique_ptr<Chunk>& chunk = chunks_[key];
  if (chunk == nullptr) {
    chunk = std::make_unique<Chunk>();
    chunk->base = lowest - kBelow;
  }
  return *chunk;
}

std::uint64_t BlockMap::Reader::Read(Masks Chunk::*masks,
                                     double x_m,
                                     double y_m,
                                     std::int64_t base) {
  const auto x = static_cast<std::int64_t>(std::floor(x_m * blocks_a_m_));
  const auto y = static_cast<std::int64_t>(std::floor(y_m * blocks_a_m_));
  const std::int64_t chunk_x = FloorDiv(x, kSide);
  const std::int64_t chunk_y = FloorDiv(y, kSide);
  if (chunk_x != chunk_x_ || chunk_y != chunk_y_) {
    chunk_x_ = chunk_x;
    chunk_y_ = chunk_y;
    const auto found = map_->chunks_.find({chunk_x, chunk_y});
    chunk_ = found == map_->chunks_.end() ? nullptr : found->second.get();
  }
  if (chunk_ == nullptr) {
    return 0;
  }
  const std::uint64_t segments =
      (chunk_
           ->*masks)[static_cast<std::size_t>((y - chunk_y * kSide) * kSide + x - chunk_x * kSide)];
  const std::int64_t shift = base - chunk_->base;
  if (shift <= -64 || shift >= 64) {
    return 0;
  }
  return shift >= 0 ? segments >> shift : segments << -shift;
}

}  // namespace atlas
