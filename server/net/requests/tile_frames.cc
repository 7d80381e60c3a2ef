#include "server/net/requests/tile_frames.h"

#include <array>
#include <utility>

#include "core/base/bytes.h"
#include "core/base/hash.h"

namespace atlas {
namespace {

constexpr std::size_t kEntryBytes = 320;  // besides the tile's own

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
  const std::lock_guard lock(mutex_);
  entries_.Insert(number, {content, std::move(body)}, bytes);
  while (entries_.TakeOldestAbove(max_bytes_)) {
  }
}

// Two with the same number only put each other out.
std::uint64_t TileFrames::NumberOf(const Content& content) {
  const std::array<std::uint64_t, 5> parts = {content.key, content.payload_hash, content.sections,
                                              content.base_hash, content.base_sections};
  return Hash64(ByteSpan(reinterpret_cast<const std::uint8_t*>(parts.data()), sizeof parts));
}

}  // namespace atlas
