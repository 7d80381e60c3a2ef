// In which blocks of the atlas structure stands, at arm's length and as wide as the atlas: sparse,
// in chunks.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_map>

#include "core/geometry/map_profile.h"
#include "core/tile/tile.h"

namespace atlas {

class BlockMap {
  static constexpr std::int64_t kSide = 64;  // blocks along a chunk

  struct Chunk {
    std::int64_t base = 0;  // of bit 0, on the world's lattice of segments
    std::array<std::uint64_t, kSide * kSide> occupied{};
    std::array<std::uint64_t, kSide * kSide> near{};  // in the block or one of the eight around it
    std::array<std::uint64_t, kSide> mapped{};        // by row: bit x is a block with any layer
  };

 public:
  // `block_m` is rounded to whole cells. A nibble from `occupied_nibble` on is structure.
  BlockMap(const MapProfile& profile, double block_m, std::uint8_t occupied_nibble);

  // Level 0 alone.
  void Add(const Tile& tile);

  double block_m() const { return block_m_; }
  double segment_m() const { return segment_m_; }
  std::size_t memory_bytes() const { return chunks_.size() * sizeof(Chunk); }

  // For look-ups near each other: remembers the chunk of the last one.
  class Reader {
   public:
    explicit Reader(const BlockMap& map) : map_(&map), blocks_a_m_(1.0 / map.block_m_) {}

    // The block at (x, y), world, metres: bit k is the segment `base` + k. 0 where nothing stands.
    std::uint64_t SegmentsAt(double x_m, double y_m, std::int64_t base) {
      return Read(&Chunk::occupied, x_m, y_m, base);
    }
    // In it or one of the eight around it.
    std::uint64_t SegmentsNear(double x_m, double y_m, std::int64_t base) {
      return Read(&Chunk::near, x_m, y_m, base);
    }

   private:
    using Masks = std::array<std::uint64_t, kSide * kSide>;
    std::uint64_t Read(Masks Chunk::*masks, double x_m, double y_m, std::int64_t base);

    const BlockMap* map_;
    double blocks_a_m_;
    const Chunk* chunk_ = nullptr;  // null: none there, or none looked for
    std::int64_t chunk_x_ = INT64_MIN;
    std::int64_t chunk_y_ = INT64_MIN;
  };

 private:
  struct Key {
    std::int64_t x;
    std::int64_t y;
    bool operator==(const Key&) const = default;
  };
  struct KeyHash {
    std::size_t operator()(const Key& key) const {
      return static_cast<std::size_t>(key.x) * 0x9E37'79B9'7F4A'7C15ULL +
             static_cast<std::size_t>(key.y) * 0xC2B2'AE3D'27D4'EB4FULL;
    }
  };

  void AddColumn(const TileLayer& layer, std::int64_t block_x, std::int64_t block_y);
  Chunk& ChunkOf(const Key& key, std::int64_t lowest);
  // What may be added to in the chunk of a block: `segments`, whose lowest is `lowest`.
  void Mark(std::array<std::uint64_t, kSide * kSide> Chunk::*masks,
            std::int64_t block_x,
            std::int64_t block_y,
            std::uint64_t segments,
            std::int64_t lowest);

  MapProfile profile_;
  std::uint8_t occupied_nibble_;
  std::int64_t block_cells_;
  double block_m_;
  double segment_m_;
  std::unordered_map<Key, std::unique_ptr<Chunk>, KeyHash> chunks_;
};

}  // namespace atlas
