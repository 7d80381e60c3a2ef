#include "client/vehicle/held_summary.h"

#include <algorithm>
#include <utility>

#include "core/base/hash.h"

namespace atlas {
namespace {

constexpr int kBlockBits = 6;
// A tile takes 16 bytes, a block 24, and a second request when it differs.
constexpr std::size_t kFewTiles = 2;
// Of a request, of either; what is beyond is not told, and comes again if it is in the area.
constexpr std::size_t kMaxTold = 65'536;

}  // namespace

void HeldSummary::Add(const TileFacts& tile) {
  const std::uint64_t block = tile.id.Key() >> kBlockBits;
  if (!block_.empty() && block_.front().id.Key() >> kBlockBits != block) EndBlock();
  block_.push_back(tile);
}

void HeldSummary::EndBlock() {
  if (block_.empty()) return;
  const SectionBits sections = block_.front().sections;
  const bool is_alike = std::all_of(block_.begin(), block_.end(), [&](const TileFacts& tile) {
    return tile.sections == sections;
  });
  const std::uint64_t block = block_.front().id.Key() >> kBlockBits;
  if (is_alike && block_.size() > kFewTiles && !differing_.contains(block)) {
    AddBlock(block);
  } else {
    for (const TileFacts& tile : block_) {
      if (told_tiles_++ >= kMaxTold) break;
      groups_[tile.sections].tiles.push_back({tile.id, tile.payload_hash});
    }
  }
  block_.clear();
}

void HeldSummary::AddBlock(std::uint64_t block) {
  if (told_blocks_++ >= kMaxTold) return;
  HeldGroup::Block told{block, 0, 0};
  ByteWriter content;
  for (const TileFacts& tile : block_) {
    told.mask |= std::uint64_t{1} << (tile.id.Key() & 63U);
    content.U64(tile.id.Key());
    content.U64(tile.payload_hash);
  }
  told.digest = Hash64(content.bytes());
  groups_[block_.front().sections].blocks.push_back(told);
}

std::vector<HeldGroup> HeldSummary::Take() {
  EndBlock();
  std::vector<HeldGroup> groups;
  for (auto& [sections, group] : groups_) {
    group.sections = sections;
    groups.push_back(std::move(group));
  }
  groups_.clear();
  return groups;
}

}  // namespace atlas
