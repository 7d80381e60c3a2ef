// Tiles in memory to plan syncs of, and the questions that tests ask.
#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "server/service/sync/sync_plan.h"

namespace atlas {

inline MapProfile SmallProfile() {
  MapProfile profile;
  profile.levels = 5;
  return profile;
}

// Tiles in memory.
class KnownTiles : public TileIndex {
 public:
  void Put(const TileId& id, std::uint64_t hash, std::uint32_t bytes = 20'000) {
    tiles_[id.Key()] = {id, ++revision_, hash, bytes};
  }
  void Remove(const TileId& id) { tiles_.erase(id.Key()); }
  const std::map<std::uint64_t, TileSummary>& tiles() const { return tiles_; }
  std::uint64_t revision() const { return revision_; }
  std::size_t lookups() const { return lookups_; }  // of blocks
  void ForgetBlock(std::uint64_t block) { forgotten_.insert(block); }

  Result<TileBlock> ReadTileBlock(std::uint64_t block) override {
    std::vector<TileSummary> tiles;
    for (auto it = tiles_.lower_bound(FirstKeyOf(block));
         it != tiles_.end() && TileBlockOf(it->first) == block; ++it) {
      tiles.push_back(it->second);
    }
    return std::make_shared<const std::vector<TileSummary>>(std::move(tiles));
  }
  TileBlock FindTileBlock(std::uint64_t block) override {
    ++lookups_;
    return forgotten_.contains(block) ? nullptr : *ReadTileBlock(block);
  }
  Status ScanTiles(const TileRect& rect,
                   const std::function<void(const TileSummary&)>& visit) override {
    for (const auto& [key, tile] : tiles_) {
      if (rect.Contains(tile.id)) {
        visit(tile);
      }
    }
    return {};
  }

 private:
  std::map<std::uint64_t, TileSummary> tiles_;
  std::set<std::uint64_t> forgotten_;
  std::uint64_t revision_ = 0;
  std::size_t lookups_ = 0;
};

// Streets of level-0 tiles, and all tiles above them.
class Streets : public KnownTiles {
 public:
  explicit Streets(std::uint32_t seed) {
    std::mt19937 random(seed);
    std::set<TileId> all;
    for (int street = 0; street < 6; ++street) {
      const auto at = static_cast<std::int32_t>(random() % 60) - 30;
      for (std::int32_t along = -30; along < 30; ++along) {
        all.insert(street % 2 == 0 ? TileId{0, along, at} : TileId{0, at, along});
      }
    }
    for (std::uint8_t level = 0; level + 1 < SmallProfile().levels; ++level) {
      for (const TileId& id : std::set<TileId>(all)) {
        if (id.level == level) {
          all.insert(id.Parent());
        }
      }
    }
    for (const TileId& id : all) {
      Put(id, random(), static_cast<std::uint32_t>(1'000 + random() % 40'000));
    }
  }
};

inline SyncArea Area(MapArea shape) {
  return SyncArea::Create(std::move(shape), SmallProfile()).value();
}
inline SyncRequest Ask(MapArea shape) {
  return {Area(std::move(shape)), 0, 0, kAllSections, {}, {}};
}
inline MapArea AnyShape(std::uint32_t seed) {
  const double x_m = seed % 7 * 40.0 - 120.0;
  switch (seed % 3) {
    case 0:
      return DiscArea{{x_m, 5.0}, 30.0 + seed % 5 * 60.0};
    case 1:
      return BoxArea{{x_m, -100.0}, {x_m + 150.0, 200.0}};
    default:
      return CorridorArea{{{x_m, -300.0}, {0.0, 0.0}, {300.0, x_m}}, 40.0};
  }
}

inline SyncPlan Plan(const SyncRequest& request, KnownTiles& tiles, const SyncLimits& limits = {}) {
  auto plan = PlanSync(request, tiles, SmallProfile(), true, limits);
  EXPECT_TRUE(plan.has_value()) << plan.error().message();
  return **std::move(plan);
}

inline std::vector<std::uint64_t> KeysOf(const std::vector<SyncItem>& items) {
  std::vector<std::uint64_t> keys;
  for (const SyncItem& item : items) {
    keys.push_back(item.tile.id.Key());
  }
  return keys;
}

inline std::set<std::uint64_t> Touched(const SyncArea& area, const KnownTiles& tiles) {
  std::set<std::uint64_t> keys;
  for (const auto& [key, tile] : tiles.tiles()) {
    if (area.Touches(tile.id)) {
      keys.insert(key);
    }
  }
  return keys;
}

inline HeldTiles Hold(std::vector<HeldTile> tiles, std::vector<HeldBlock> blocks = {}) {
  return HeldTiles::Create(std::move(tiles), std::move(blocks)).value();
}

}  // namespace atlas
