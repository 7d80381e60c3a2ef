// Which tiles there are, as far as it was asked for lately: so that a vehicle that asks what is new
// does not ask the disk. Disposable, bounded by bytes, thread-safe.
//
// It never tells less than what a reader of the store can see: whoever changes a tile calls
// BeginChange() before that can be seen and EndChange() once it can, or never will; in between, and
// where a block was read before, nothing of its block is kept.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>

#include "core/base/lru_list.h"
#include "server/store/tile_block.h"

namespace atlas {

class TileDirectory {
 public:
  explicit TileDirectory(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  // Null: not there.
  TileBlock Find(std::uint64_t block);
  // To be called before the block is read from the store, for Insert().
  std::uint64_t Version(std::uint64_t block) const;
  // Keeps it, unless one of its tiles changed since then, or is about to.
  void Insert(std::uint64_t block, std::uint64_t version, TileBlock tiles);

  void BeginChange(const TileId& id);
  void EndChange(const TileId& id);

  std::size_t bytes() const;

 private:
  // Of all blocks that fall into it; one that changes too often only costs time.
  struct Slot {
    std::uint64_t version = 0;
    std::uint32_t changing = 0;
  };

  Slot& SlotOf(std::uint64_t block) { return slots_[block % slots_.size()]; }
  const Slot& SlotOf(std::uint64_t block) const { return slots_[block % slots_.size()]; }

  const std::size_t max_bytes_;
  mutable std::mutex mutex_;
  LruList<TileBlock> blocks_;
  std::array<Slot, 1021> slots_{};  // a prime: neighbours do not share one
};

}  // namespace atlas
