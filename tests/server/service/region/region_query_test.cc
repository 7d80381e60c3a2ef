// Region queries: order, budget, and the disc.
#include "server/service/region/region_query.h"

#include <set>

#include "tests/server/service/service_fixture.h"

namespace atlas {
namespace {

constexpr std::size_t kEnd = 64;

std::size_t Cost(const StoredTile& tile) {
  return tile.blob.size() + 40;
}

class RegionQueryTest : public ServiceTest {
 protected:
  void SetUp() override {
    Open(2);
    UploadDrive(10);
    Digest();
  }
  std::vector<StoredTile> Run(const RegionRequest& request, std::size_t max_candidates = 65'536) {
    auto query = service_->Query(request, {max_candidates, kEnd, Cost});
    EXPECT_TRUE(query.has_value()) << query.error().message();
    std::vector<StoredTile> tiles;
    for (auto tile = query->Next(); tile.value().has_value(); tile = query->Next()) {
      tiles.push_back(std::move(**tile));
    }
    is_truncated_ = query->is_truncated();
    return tiles;
  }
  static double DistanceTo(const TileId& id, double x_m, double y_m) {
    const double side = 3.2 * (1 << id.level);
    return std::hypot((id.x + 0.5) * side - x_m, (id.y + 0.5) * side - y_m);
  }
  static std::vector<TileId> Ids(const std::vector<StoredTile>& tiles) {
    std::vector<TileId> ids;
    for (const StoredTile& tile : tiles) {
      ids.push_back(tile.id);
    }
    return ids;
  }

  bool is_truncated_ = false;
};

TEST_F(RegionQueryTest, CoarseFirstThenNearestFirst) {
  const RegionRequest request{RegionDisc{1'000'000, 500'000, 6'000'000}};
  const auto tiles = Run(request);
  ASSERT_GT(tiles.size(), 10u);
  EXPECT_EQ(tiles.front().id.level, 3);
  EXPECT_EQ(tiles.back().id.level, 0);
  for (std::size_t i = 1; i < tiles.size(); ++i) {
    ASSERT_LE(tiles[i].id.level, tiles[i - 1].id.level);
    if (tiles[i].id.level == tiles[i - 1].id.level) {
      EXPECT_LE(DistanceTo(tiles[i - 1].id, 1.0, 0.5), DistanceTo(tiles[i].id, 1.0, 0.5) + 1e-9);
    }
  }
  EXPECT_FALSE(is_truncated_);
}

TEST_F(RegionQueryTest, TheDiscIsExactlyWhatItTouches) {
  const auto tiles = Run({RegionDisc{1'000'000, 500'000, 4'000'000}, 0, 0, true});
  std::set<TileId> inside;
  const auto stored = store_->ListTiles(-1, 10'000).value();
  for (const TileSummary& tile : stored) {
    const double x = std::clamp(1.0, tile.id.x * 3.2, (tile.id.x + 1) * 3.2);
    const double y = std::clamp(0.5, tile.id.y * 3.2, (tile.id.y + 1) * 3.2);
    if (tile.id.level == 0 && std::hypot(x - 1.0, y - 0.5) <= 4.0) {
      inside.insert(tile.id);
    }
  }
  const auto ids = Ids(tiles);
  EXPECT_EQ(std::set<TileId>(ids.begin(), ids.end()), inside);
}

TEST_F(RegionQueryTest, WithoutADiscEverythingComesOnce) {
  const auto tiles = Run({});
  EXPECT_EQ(tiles.size(), store_->ListTiles(-1, 10'000)->size());
}

TEST_F(RegionQueryTest, FewCandidatesAtATimeGiveTheSameOrder) {
  const RegionRequest request{RegionDisc{0, 0, 20'000'000}};
  const auto whole = Ids(Run(request));
  for (const std::size_t max_candidates : {1u, 2u, 7u}) {
    EXPECT_EQ(Ids(Run(request, max_candidates)), whole);
  }
}

TEST_F(RegionQueryTest, EveryBudgetIsKeptAndCutsAPrefix) {
  const RegionRequest all{RegionDisc{0, 0, 5'000'000}};
  const auto whole = Run(all);
  std::size_t total = kEnd;
  for (const StoredTile& tile : whole) {
    total += Cost(tile);
  }
  for (std::size_t budget = kEnd; budget <= total; budget += 97) {
    RegionRequest request = all;
    request.budget_bytes = budget;
    const auto tiles = Run(request);
    std::size_t used = kEnd;
    for (std::size_t i = 0; i < tiles.size(); ++i) {
      used += Cost(tiles[i]);
      ASSERT_EQ(tiles[i].id, whole[i].id);
    }
    ASSERT_LE(used, budget);
    ASSERT_TRUE(is_truncated_);
  }
  RegionRequest exact = all;
  exact.budget_bytes = total;
  EXPECT_EQ(Run(exact).size(), whole.size());
  EXPECT_FALSE(is_truncated_);
}

TEST_F(RegionQueryTest, LevelsCanBeChosen) {
  for (const StoredTile& tile : Run({RegionDisc{0, 0, 5'000'000}, 1, 2})) {
    EXPECT_TRUE(tile.id.level == 1 || tile.id.level == 2);
  }
  const RegionQuery::Options options{10, kEnd, Cost};
  EXPECT_EQ(service_->Query({std::nullopt, 4}, options).error().code(),
            StatusCode::kInvalidArgument);
  EXPECT_EQ(service_->Query({std::nullopt, 0, 0, false, kEnd - 1}, options).error().code(),
            StatusCode::kInvalidArgument);
}

TEST_F(RegionQueryTest, HostileDiscsAreHarmless) {
  for (const std::int64_t x : {INT64_MIN, std::int64_t{0}, INT64_MAX}) {
    for (const std::uint64_t radius : {std::uint64_t{0}, UINT64_MAX}) {
      Run({RegionDisc{x, -(x / 2), radius}});
    }
  }
}

}  // namespace
}  // namespace atlas
