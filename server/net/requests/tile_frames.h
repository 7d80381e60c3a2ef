// Tiles as they go out, kept for the next one who asks: bounded by bytes, disposable, thread-safe.
// Those of earlier contents leave by their age; until then they are what deltas are made against.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>

#include "core/base/lru_list.h"
#include "core/tile/tile_container.h"
#include "proto/wire/tile_body.h"

namespace atlas {

class TileFrames {
 public:
  explicit TileFrames(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  struct Content {
    std::uint64_t key = 0;
    std::uint64_t payload_hash = 0;
    SectionMask sections = kAllSections;
    // Of who holds an earlier content: the best to send, a delta or the whole. 0: the whole.
    std::uint64_t base_hash = 0;
    SectionMask base_sections = 0;

    bool operator==(const Content&) const = default;
  };

  // Null: not there. Of whatever revision: the same content may get another.
  std::shared_ptr<const TileBody> Find(const Content& content);
  void Insert(const Content& content, std::shared_ptr<const TileBody> body);

 private:
  struct Entry {
    Content content;
    std::shared_ptr<const TileBody> body;
  };

  static std::uint64_t NumberOf(const Content& content);

  const std::size_t max_bytes_;
  std::mutex mutex_;
  LruList<Entry> entries_;
};

}  // namespace atlas
