// Which tiles there are, as far as it was asked for lately: so that a vehicle that asks what is new
// does not ask the disk. Disposable, bounded by bytes, thread-safe.
//
// It never tells less than what anybody was told of: whoever changes a tile calls Forget() once the
// change can be seen, and before a word of it goes out. What was read before is not kept then.
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
  // Keeps it, unless one of its tiles changed since then.
  void Insert(std::uint64_t block, std::uint64_t version, TileBlock tiles);

  // The block of a tile that changed.
  void Forget(const TileId& id);

  std::size_t bytes() const;

 private:
  // Of all blocks that fall into it: that another one changed only costs time.
  static std::size_t SlotOf(std::uint64_t block) { return block % kSlots; }

  static constexpr std::size_t kSlots = 1021;  // a prime: neighbours do not share one

  const std::size_t max_bytes_;
  mutable std::mutex mutex_;
  LruList<TileBlock> blocks_;
  std::array<std::uint64_t, kSlots> versions_{};
};

}  // namespace atlas
