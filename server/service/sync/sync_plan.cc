#include "server/service/sync/sync_plan.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

// At this distance from the vehicle and its way a tile counts for an eighth: as much as one of the
// next coarser level does beside it.
constexpr double kNear_m = 20.0;
constexpr double kOfTheCover = 1e30;  // before everything else
constexpr double kLater = 1e-60;      // after everything else

// A tile of the level above, as its children ask for it.
struct Parent {
  std::uint64_t key = 0;
  double priority = 0.0;
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
        is_tile_seen_(request.held.tiles().size(), false),
        is_block_seen_(request.held.blocks().size(), false) {
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
    parents_ = std::exchange(here_, {});
    if (request_.area.tiles() != nullptr) {
      return RunTiles(*request_.area.tiles());
    }
    const TileRect rect = request_.area.Bounds(level_);
    constexpr int kBits = kTileBlockSideBits;
    const std::int64_t min_x = rect.min_x >> kBits;
    const std::int64_t min_y = rect.min_y >> kBits;
    const std::int64_t width = (rect.max_x >> kBits) - min_x + 1;
    const std::int64_t height = (rect.max_y >> kBits) - min_y + 1;
    if (width * height > static_cast<std::int64_t>(limits_.max_blocks)) {
      return Scan(rect);
    }
    std::vector<std::uint64_t> blocks;
    for (std::int64_t y = min_y; y < min_y + height; ++y) {
      for (std::int64_t x = min_x; x < min_x + width; ++x) {
        const TileId corner{level_, static_cast<std::int32_t>(x * kTileBlockSide),
                            static_cast<std::int32_t>(y * kTileBlockSide)};
        if (request_.area.Touches(corner, kBits)) {
          blocks.push_back(TileBlockOf(corner.Key()));
        }
      }
    }
    std::sort(blocks.begin(), blocks.end());
    return RunBlocks(blocks);
  }

  Result<bool> RunTiles(const std::vector<TileId>& ids) {
    std::vector<std::uint64_t> blocks;
    for (const TileId& id : ids) {
      const std::uint64_t block = TileBlockOf(id.Key());
      if (id.level == level_ && (blocks.empty() || blocks.back() != block)) {
        blocks.push_back(block);
      }
    }
    return RunBlocks(blocks);
  }

  Result<bool> RunBlocks(const std::vector<std::uint64_t>& blocks) {
    work_ += blocks.size() * std::max<std::size_t>(request_.area.way_points(), 1);
    if (!may_block_ && work_ > limits_.max_work_at_once) {
      return false;
    }
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
      is_block_seen_[index] = true;
      if (is_same && (request_.sections & ~held->sections) == 0) {
        SetBit(plan_.current_blocks, held->number);
      } else if (!is_same) {
        plan_.differing.push_back(block);
      }
    }
    for (const TileSummary& tile : tiles) {
      if (!request_.area.Touches(tile.id)) {
        continue;
      }
      if (++tiles_ > limits_.max_tiles) {
        return {StatusCode::kInvalidArgument,
                StrCat("sync: more than ", limits_.max_tiles,
                       " tiles are in this area: ask for coarser levels, or for parts of it")};
      }
      const std::uint64_t key = tile.id.Key();
      const bool is_of_held =
          held != nullptr && (held->tiles >> (key - FirstKeyOf(block)) & 1u) != 0;
      if (is_of_held) {
        AddOfBlock(tile, *held, is_same);
      } else {
        Add(tile, request_.held.Find(key));
      }
    }
    return {};
  }

  static bool IsSame(const HeldBlock& held, std::span<const TileSummary> tiles) {
    HeldDigest digest;
    int count = 0;
    for (const TileSummary& tile : tiles) {
      if ((held.tiles >> (tile.id.Key() - FirstKeyOf(held.block)) & 1u) != 0) {
        digest.Add(tile.id.Key(), tile.payload_hash);
        ++count;
      }
    }
    return count == std::popcount(held.tiles) && digest.value() == held.digest;
  }

  void AddOfBlock(const TileSummary& tile, const HeldBlock& held, bool is_same) {
    if (!is_same) {
      here_.push_back({tile.id.Key(), kOfTheCover});  // as if it were held: it is asked for again
      return;
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
      here_.push_back({tile.id.Key(), kOfTheCover});
      return;
    }
    SyncItem item{tile, missing, held != nullptr && !is_same ? held->payload_hash : 0,
                  PriorityOf(tile)};
    here_.push_back({tile.id.Key(), item.priority});
    if (request_.after && tile.revision > request_.after->revision) {
      // Where it stood before is not known any more: it may have been sent or not.
      item.priority *= kLater;
    }
    if (IsNew(item)) {
      plan_.items.push_back(item);
      if (plan_.items.size() > 2 * limits_.max_items) {
        Cut();
      }
    }
  }

  void NoteSeen(const HeldTile* held, bool is_current) {
    const auto& tiles = request_.held.tiles();
    if (held < tiles.data() || held >= tiles.data() + tiles.size()) {
      return;  // none, or one of a block
    }
    const auto index = static_cast<std::size_t>(held - tiles.data());
    is_tile_seen_[index] = true;
    if (is_current) {
      SetBit(plan_.current_tiles, held->number);
    }
  }

  // The error that it removes, over its area, for each of its bytes; never more than its parent's.
  double PriorityOf(const TileSummary& tile) const {
    const double side_m = std::ldexp(profile_.tile_size_m(), level_);
    const double near = 1.0 + request_.area.Distance(tile.id) / kNear_m;
    const double weight = side_m * side_m / (near * near * near);
    const double own = GeometricError(level_, profile_) * weight / std::max(tile.blob_bytes, 1u);
    if (level_ == coarsest_) {
      return own * kOfTheCover;
    }
    const std::uint64_t parent = tile.id.Parent().Key();
    const auto found = std::partition_point(parents_.begin(), parents_.end(),
                                            [parent](const Parent& p) { return p.key < parent; });
    return found != parents_.end() && found->key == parent ? std::min(own, found->priority) : own;
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
      items.erase(end, items.end());
      plan_.is_cut = true;
    }
  }

  void Sort() {
    Cut();
    std::sort(plan_.items.begin(), plan_.items.end(), &ComesBefore);
  }

  void NoteRemoved() {
    const auto& tiles = request_.held.tiles();
    for (std::size_t i = 0; i < tiles.size(); ++i) {
      if (!is_tile_seen_[i] && IsAsked(TileId::FromKey(tiles[i].key).value(), 0)) {
        plan_.removed.push_back(tiles[i].key);
      }
    }
    const auto& blocks = request_.held.blocks();
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      const TileId corner = TileId::FromKey(FirstKeyOf(blocks[i].block)).value();
      if (!is_block_seen_[i] && IsAsked(corner, kTileBlockSideBits)) {
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
  std::uint32_t coarsest_ = 0;
  std::uint8_t level_ = 0;
  std::vector<Parent> parents_;     // of the level above, in key order
  std::vector<Parent> here_;        // of this one
  std::vector<bool> is_tile_seen_;  // of those that are held
  std::vector<bool> is_block_seen_;
  std::size_t tiles_ = 0;
  std::size_t work_ = 0;
  SyncPlan plan_;
};

}  // namespace

double GeometricError(std::uint8_t level, const MapProfile& profile) {
  return std::ldexp(profile.cell_size_m(), level);
}

Result<std::optional<SyncPlan>> PlanSync(const SyncRequest& request,
                                         TileIndex& index,
                                         const MapProfile& profile,
                                         bool may_block,
                                         const SyncLimits& limits) {
  return Planner(request, index, profile, may_block, limits).Run();
}

}  // namespace atlas
