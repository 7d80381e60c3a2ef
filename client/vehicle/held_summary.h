// Held tiles as a sync tells them: a digest for a block of many, single ones where they are few,
// where a block was said to differ, or where it is held with several sets of sections.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "client/connection/sync_query.h"
#include "client/vehicle/tile_files.h"

namespace atlas {

class HeldSummary {
 public:
  // Blocks whose tiles are told one by one; the set outlives the summary.
  explicit HeldSummary(const std::set<std::uint64_t>& differing) : differing_(differing) {}

  // In key order.
  void Add(const TileFacts& tile);
  std::vector<HeldGroup> Take();

 private:
  void EndBlock();
  void AddBlock(std::uint64_t block);

  const std::set<std::uint64_t>& differing_;
  std::vector<TileFacts> block_;  // the tiles of the one that is being added
  std::map<SectionBits, HeldGroup> groups_;
  std::size_t told_tiles_ = 0;
  std::size_t told_blocks_ = 0;
};

}  // namespace atlas
