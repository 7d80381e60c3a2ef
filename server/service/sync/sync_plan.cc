#include "server/service/sync/sync_plan.h"

#include <algorithm>
#include <limits>
#include <span>
#include <utility>

#include "core/base/str_cat.h"
#include "server/service/sync/area_blocks.h"
#include "server/service/sync/local_area.h"
#include "server/service/sync/plan_work.h"

namespace atlas {
namespace {

// How far a tile is off, kept for those above the next one: tiles come in key order, siblings
// together.
struct KnownDistance {
  std::optional<std::uint64_t> key;
  double distance_m = 0.0;
};

void SetBit(Bytes& bits, std::size_t index) {
  bits[index / 8] = static_cast<std::uint8_t>(bits[index / 8] | 1u << index % 8);
}

class Planner {
 public:
  Planner(const SyncRequest& request,
          TileIndex& index,
          const MapProfile& profile,
          bool may_block,
          const SyncLimits& limits)
      : request_(request),
        index_(index),
        profile_(profile),
        may_block_(may_block),
        limits_(limits),
        work_(may_block ? std::numeric_limits<std::size_t>::max() : limits.max_work_at_once) {
    plan_.is_tile_seen.resize(request.held.tiles().size());
    plan_.is_block_seen.resize(request.held.blocks().size());
    plan_.current_tiles.resize((request.held.tiles().size() + 7) / 8);
    plan_.current_blocks.resize((request.held.blocks().size() + 7) / 8);
  }

  Result<std::optional<SyncPlan>> Run() {
    const std::uint32_t last = profile_.levels - 1u;
    coarsest_ = request_.coarsest_level == 0 ? last : std::min(request_.coarsest_level, last);
    if (request_.finest_level > coarsest_) {
      return Error(StatusCode::kInvalidArgument,
                   StrCat("sync: finest level ", request_.finest_level,
                          ", expected 0 to the coarsest, ", coarsest_));
    }
    // What becomes of what is held: each is compared once more.
    const std::size_t held = request_.held.tiles().size() + request_.held.blocks().size();
    if (!work_.Take(held * request_.area.legs().size())) {
      return std::nullopt;
    }
    distances_.resize(coarsest_ + 1);
    for (level_ = static_cast<std::uint8_t>(coarsest_);; --level_) {
      const Result<bool> is_done = RunLevel();
      if (!is_done) {
        return Error(is_done.error());
      }
      if (!*is_done) {
        return std::nullopt;
      }
      if (level_ == request_.finest_level) {
        break;
      }
    }
    NoteRemoved();
    Sort();
    return std::move(plan_);
  }

 private:
  // False: it takes the disk, or long.
  Result<bool> RunLevel() {
    if (request_.area.tile_keys() != nullptr) {
      return RunTiles(*request_.area.tile_keys());
    }
    const BlockRect rect = BlocksAround(request_.area, level_);
    if (rect.count() > static_cast<std::int64_t>(limits_.max_blocks)) {
      return Scan(request_.area.Bounds(level_));
    }
    const auto blocks = FindBlocks(request_.area, rect, work_);
    return blocks ? RunBlocks(*blocks) : false;
  }

  Result<bool> RunTiles(const std::vector<std::uint64_t>& keys) {
    constexpr std::int32_t kMin = TileId::kMinCoordinate;
    constexpr std::int32_t kMax = TileId::kMaxCoordinate;
    const auto end = std::upper_bound(keys.begin(), keys.end(), TileId{level_, kMax, kMax}.Key());
    auto key = std::lower_bound(keys.begin(), end, TileId{level_, kMin, kMin}.Key());
    if (key == end) {
      return true;
    }
    std::vector<std::uint64_t> blocks;
    for (; key != end; ++key) {
      const std::uint64_t block = TileBlockOf(*key);
      if (blocks.empty() || blocks.back() != block) {
        blocks.push_back(block);
      }
    }
    if (!work_.Take(blocks.size() * WorkOfBlock(request_.area))) {
      return false;
    }
    return RunBlocks(blocks);
  }

  Result<bool> RunBlocks(const std::vector<std::uint64_t>& blocks) {
    for (const std::uint64_t block : blocks) {
      TileBlock tiles = index_.FindTileBlock(block);
      if (tiles == nullptr) {
        if (!may_block_) {
          return false;
        }
        Result<TileBlock> read = index_.ReadTileBlock(block);
        if (!read) {
          return Error(read.error());
        }
        tiles = *std::move(read);
      }
      if (Status status = AddBlock(block, *tiles); !status.ok()) {
        return Error(std::move(status));
      }
    }
    return true;
  }

  // A large area, most of it empty.
  Result<bool> Scan(const TileRect& rect) {
    if (!may_block_) {
      return false;
    }
    Status failure;
    std::vector<TileSummary> tiles;  // of one block
    const auto end_block = [&] {
      if (!tiles.empty() && failure.ok()) {
        failure = AddBlock(TileBlockOf(tiles[0].id.Key()), tiles);
      }
      tiles.clear();
    };
    Status status = index_.ScanTiles(rect, [&](const TileSummary& tile) {
      if (!tiles.empty() && TileBlockOf(tiles[0].id.Key()) != TileBlockOf(tile.id.Key())) {
        end_block();
      }
      tiles.push_back(tile);
    });
    end_block();
    if (!status.ok() || !failure.ok()) {
      return Error(status.ok() ? std::move(failure) : std::move(status));
    }
    return true;
  }

  Status AddBlock(std::uint64_t block, std::span<const TileSummary> tiles) {
    const HeldBlock* held = request_.held.FindBlock(block);
    const bool is_same = held != nullptr && IsSame(*held, tiles);
    if (held != nullptr) {
      const auto index = static_cast<std::size_t>(held - request_.held.blocks().data());
      plan_.is_block_seen[index] = true;
      if (is_same && (request_.sections & ~held->sections) == 0) {
        SetBit(plan_.current_blocks, held->number);
      } else if (!is_same) {
        plan_.differing.push_back(block);
      }
    }
    if (tiles.empty()) {
      return {};
    }
    LookAt(block);
    if (request_.area.tile_keys() != nullptr) {
      return AddNamed(*request_.area.tile_keys(), block, tiles, held, is_same);
    }
    for (const TileSummary& tile : tiles) {
      if (local_->Touches(tile.id)) {
        ATLAS_RETURN_IF_ERROR(AddWithin(tile, held, is_same));
      }
    }
    return {};
  }

  // Few of a block, mostly.
  Status AddNamed(const std::vector<std::uint64_t>& keys,
                  std::uint64_t block,
                  std::span<const TileSummary> tiles,
                  const HeldBlock* held,
                  bool is_same) {
    const auto is_before = [](const TileSummary& tile, std::uint64_t key) {
      return tile.id.Key() < key;
    };
    auto tile = tiles.begin();
    for (auto key = std::lower_bound(keys.begin(), keys.end(), FirstKeyOf(block));
         key != keys.end() && TileBlockOf(*key) == block; ++key) {
      tile = std::lower_bound(tile, tiles.end(), *key, is_before);
      if (tile != tiles.end() && tile->id.Key() == *key) {
        ATLAS_RETURN_IF_ERROR(AddWithin(*tile, held, is_same));
      }
    }
    return {};
  }

  // One of the area, and the block of which it is, if that is held.
  Status AddWithin(const TileSummary& tile, const HeldBlock* held, bool is_same) {
    if (++tiles_ > limits_.max_tiles) {
      return {StatusCode::kInvalidArgument,
              StrCat("sync: more than ", limits_.max_tiles,
                     " tiles are in this area: ask for coarser levels, or for parts of it")};
    }
    const std::uint64_t key = tile.id.Key();
    const bool is_of_held =
        held != nullptr && (held->tiles >> (key - FirstKeyOf(held->block)) & 1u) != 0;
    if (is_of_held) {
      AddOfBlock(tile, *held, is_same);
    } else {
      Add(tile, request_.held.Find(key));
    }
    return {};
  }

  void LookAt(std::uint64_t block) {
    local_.emplace(request_.area, TileId::FromKey(FirstKeyOf(block)).value(), kTileBlockSideBits);
    most_worth_ = TileWorth(profile_, level_, local_->least_m());
    least_worth_ = TileWorth(profile_, level_, local_->most_m());
  }

  void AddOfBlock(const TileSummary& tile, const HeldBlock& held, bool is_same) {
    if (!is_same) {
      return;  // it is asked for again
    }
    const HeldTile as_tile{tile.id.Key(), tile.payload_hash, held.sections};
    Add(tile, &as_tile);
  }

  void Add(const TileSummary& tile, const HeldTile* held) {
    const bool is_same = held != nullptr && held->payload_hash == tile.payload_hash;
    const SectionMask missing = is_same ? request_.sections & ~held->sections : request_.sections;
    NoteSeen(held, is_same && missing == 0);
    if (is_same && missing == 0) {
      ++plan_.not_modified;
      return;
    }
    const bool has_moved = request_.after && tile.revision > request_.after->revision;
    const double bytes = std::clamp<double>(tile.blob_bytes, kLeastBytes, kMostBytes);
    if (!has_moved && IsElsewhere(bytes)) {
      return;
    }
    SyncItem item{tile, missing};
    if (held != nullptr && !is_same) {
      item.held_hash = held->payload_hash;
      item.held_sections = held->sections;
    }
    const double worth = TileWorth(profile_, tile.id.level, DistanceOf(tile.id));
    if (has_moved) {
      // Where it stood before is not known any more, but not behind the last place that it can
      // have, which is before its children. If that is over it was sent, as it was.
      item.priority = Banded(worth / kMostBytes);
      if (!IsNew(item)) {
        item.priority = worth / kMostBytes * kLater;
      }
    } else {
      item.priority = Banded(worth / bytes);
    }
    if (IsNew(item)) {
      plan_.items.push_back(item);
      if (plan_.items.size() > 2 * limits_.max_items) {
        Cut();
      }
    }
  }

  // Wherever in its block it is, a tile of so many bytes was sent before, or comes after all that
  // there is room for: exactly where need not be known.
  bool IsElsewhere(double bytes) {
    if (request_.after && Banded(least_worth_ / bytes) > request_.after->priority) {
      return true;
    }
    const bool is_later = Banded(most_worth_ / bytes) < left_out_;
    plan_.is_cut = plan_.is_cut || is_later;
    return is_later;
  }

  void NoteSeen(const HeldTile* held, bool is_current) {
    const auto& tiles = request_.held.tiles();
    if (held < tiles.data() || held >= tiles.data() + tiles.size()) {
      return;  // none, or one of a block
    }
    const auto index = static_cast<std::size_t>(held - tiles.data());
    plan_.is_tile_seen[index] = true;
    if (is_current) {
      SetBit(plan_.current_tiles, held->number);
    }
  }

  double Banded(double priority) const {
    return level_ == coarsest_ ? priority * kOfTheCover : priority;
  }

  // Never less than its parent's: that may be nearest to the way where more is to be driven.
  double DistanceOf(const TileId& id) {
    if (request_.area.legs().empty()) {
      return 0.0;
    }
    KnownDistance& known = distances_[id.level];
    const std::uint64_t key = id.Key();
    if (known.key != key) {
      const double above_m = id.level < coarsest_ ? DistanceOf(id.Parent()) : 0.0;
      const bool is_within = id.level <= level_ + kTileBlockSideBits;
      const double own_m = is_within ? local_->Distance(id) : request_.area.Distance(id);
      known = {key, std::max(above_m, own_m)};
    }
    return known.distance_m;
  }

  bool IsNew(const SyncItem& item) const {
    return !request_.after || item.priority < request_.after->priority ||
           (item.priority == request_.after->priority && item.tile.id.Key() < request_.after->key);
  }

  static bool ComesBefore(const SyncItem& a, const SyncItem& b) {
    if (a.priority != b.priority) {
      return a.priority > b.priority;
    }
    // Of equals a parent, whose key is the larger one, comes first.
    return a.tile.id.Key() > b.tile.id.Key();
  }

  void Cut() {
    auto& items = plan_.items;
    if (items.size() > limits_.max_items) {
      const auto end = items.begin() + static_cast<std::ptrdiff_t>(limits_.max_items);
      std::nth_element(items.begin(), end, items.end(), &ComesBefore);
      left_out_ = end->priority;
      items.erase(end, items.end());
      plan_.is_cut = true;
    }
  }

  void Sort() {
    Cut();
    std::sort(plan_.items.begin(), plan_.items.end(), &ComesBefore);
    plan_.items.shrink_to_fit();  // kept for as long as the reply takes
  }

  void NoteRemoved() {
    const auto& tiles = request_.held.tiles();
    for (std::size_t i = 0; i < tiles.size(); ++i) {
      if (!plan_.is_tile_seen[i] && IsAsked(TileId::FromKey(tiles[i].key).value(), 0)) {
        plan_.removed.push_back(tiles[i].key);
      }
    }
    const auto& blocks = request_.held.blocks();
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      const TileId corner = TileId::FromKey(FirstKeyOf(blocks[i].block)).value();
      if (!plan_.is_block_seen[i] && IsAsked(corner, kTileBlockSideBits)) {
        plan_.differing.push_back(blocks[i].block);
      }
    }
  }

  bool IsAsked(const TileId& id, int bits) const {
    return id.level >= request_.finest_level && id.level <= coarsest_ &&
           request_.area.Touches(id, bits);
  }

  const SyncRequest& request_;
  TileIndex& index_;
  const MapProfile& profile_;
  const bool may_block_;
  const SyncLimits& limits_;
  PlanWork work_;
  std::uint32_t coarsest_ = 0;
  std::uint8_t level_ = 0;
  std::vector<KnownDistance> distances_;  // by level
  std::optional<LocalArea> local_;        // of the block at hand, as are the next two
  double least_worth_ = 0.0;
  double most_worth_ = 0.0;
  double left_out_ = 0.0;  // of the best item that there was no room for
  std::size_t tiles_ = 0;
  SyncPlan plan_;
};

}  // namespace

Result<std::optional<SyncPlan>> PlanSync(const SyncRequest& request,
                                         TileIndex& index,
                                         const MapProfile& profile,
                                         bool may_block,
                                         const SyncLimits& limits) {
  return Planner(request, index, profile, may_block, limits).Run();
}

}  // namespace atlas
