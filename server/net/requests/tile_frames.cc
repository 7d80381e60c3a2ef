#include "server/net/requests/tile_frames.h"

#include <utility>

#include "core/base/bytes.h"
#include "core/base/hash.h"
#include "server/service/process_memory.h"

namespace atlas {
namespace {

constexpr std::size_t kEntryBytes = 320;  // besides the tile's own
// Tiles come and go in any order and leave holes between them: this much may be holes before they
// are given back, which takes milliseconds.
constexpr std::size_t kMaxLeftFree = std::size_t{64} << 20;

}  // namespace

std::shared_ptr<const TileBody> TileFrames::Find(const Content& content) {
  const std::uint64_t number = NumberOf(content);
  const std::lock_guard lock(mutex_);
  const Entry* entry = entries_.Use(number);
  return entry != nullptr && entry->content == content ? entry->body : nullptr;
}

void TileFrames::Insert(const Content& content, std::shared_ptr<const TileBody> body) {
  const std::uint64_t number = NumberOf(content);
  const std::size_t bytes = body->bytes().size() + kEntryBytes;
  std::unique_lock lock(mutex_);
  entries_.Insert(number, {content, std::move(body)}, bytes);
  while (const auto oldest = entries_.TakeOldestAbove(max_bytes_)) {
    left_free_ += oldest->body->bytes().size();
  }
  if (left_free_ > kMaxLeftFree) {
    left_free_ = 0;
    lock.unlock();
    ReturnFreeMemory();
  }
}

// Two with the same number only put each other out.
std::uint64_t TileFrames::NumberOf(const Content& content) {
  ByteWriter out;
  out.U64(content.key);
  out.U64(content.revision);
  out.U64(content.sections);
  return Hash64(out.bytes());
}

}  // namespace atlas
