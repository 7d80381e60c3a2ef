// Preset bounded: segments that count no more, but would if a few of those that do went.
// Compressed, in batches as they were displaced.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/fusion/survey/settled_segments.h"

namespace atlas {

class SpareSegments {
 public:
  bool is_empty() const { return batches_.empty(); }
  std::size_t bytes() const;

  // `batch` names its stretches by numbers that stay theirs.
  void Push(SettledSegments batch);
  // Drops the oldest while they take more than `max_bytes`, never the two that were pushed last.
  // Returns the stretches of what is gone.
  std::vector<std::uint32_t> DropOldest(std::size_t max_bytes);
  // All batches, ready to be read; none are left.
  std::vector<SettledSegments> TakeAll();

 private:
  struct Batch {
    SettledSegments segments;  // packed
    std::vector<std::uint32_t> stretches;
  };
  std::vector<Batch> batches_;  // the oldest first
};

}  // namespace atlas
