// Tiles, their revisions, and the dirty marks that lead to them.
#include <limits>
#include <optional>
#include <set>
#include <string>

#include "server/store/tile_ranges.h"
#include "tests/server/store/lost_rows.h"
#include "tests/server/store/store_fixture.h"

namespace atlas {
namespace {

const TileId kA{0, 0, 0};
const TileId kB{0, 3, -2};

class TileStoreTest : public StoreTest {
 protected:
  // One tile; its row is not found, and the index lists it.
  void LoseTheTile() {
    Open();
    ASSERT_TRUE(Put(MakeKeyframe(1, {kA})).has_value());
    ASSERT_TRUE(Finish(Claim().claims.at(0), Content(7)).has_value());
    Tamper(testing::LoseTiles("key = " + std::to_string(kA.Key())));
    Open();
  }
  Result<FinishResult> FuseAgain(const std::optional<TileContent>& content) {
    Await<std::uint32_t>([&](auto done) { store_->MarkDirty({kA}, std::move(done)); }).value();
    return Finish(Claim().claims.at(0), content);
  }
  void ExpectTiles(std::size_t count) {
    EXPECT_EQ(store_->ListTiles(-1, 10)->size(), count);
    EXPECT_EQ(store_->ReadCounts()->tiles, count);
    const Status counted = store_->CheckCounters();
    EXPECT_TRUE(counted.ok()) << counted.message();
  }
};

TEST_F(TileStoreTest, FinishedTileIsServedAndMarksItsParentOnce) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA})).has_value());
  const auto finished = Finish(Claim().claims.at(0), Content(7)).value();
  EXPECT_TRUE(finished.is_changed);
  EXPECT_EQ(finished.revision, 2u);
  const auto tile = store_->ReadTile(kA).value();
  ASSERT_TRUE(tile.has_value());
  EXPECT_EQ(tile->revision, 2u);
  EXPECT_EQ(tile->payload_hash, 7u);
  EXPECT_EQ(tile->blob, Content(7).blob);
  const ClaimResult parents = Claim();
  ASSERT_EQ(parents.claims.size(), 1u);
  EXPECT_EQ(parents.claims[0].id, kA.Parent());
  EXPECT_EQ(parents.claims[0].since, 1u);
  EXPECT_EQ(parents.claims[0].generation, 2u);
}

TEST_F(TileStoreTest, TheRevisionMovesOnlyWithThePayload) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA})).has_value());
  ASSERT_TRUE(Finish(Claim().claims.at(0), Content(7)).has_value());
  ASSERT_TRUE(Finish(Claim().claims.at(0), std::nullopt).has_value());
  ASSERT_TRUE(Put(MakeKeyframe(2, {kA})).has_value());
  const auto same = Finish(Claim().claims.at(0), Content(7)).value();
  EXPECT_FALSE(same.is_changed);
  EXPECT_EQ(store_->ReadTile(kA).value()->revision, 2u);
  EXPECT_EQ(Dirty().dirty_tiles, 0u);  // the parent was not marked
}

TEST_F(TileStoreTest, AnEmptyTileIsDeleted) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA})).has_value());
  ASSERT_TRUE(Finish(Claim().claims.at(0), Content(7)).has_value());
  EXPECT_EQ(store_->ReadCounts()->cells, 10u);
  EXPECT_EQ(store_->ReadCounts()->multilayer_cells, 7u);
  ASSERT_TRUE(Put(MakeKeyframe(2, {kA})).has_value());
  const auto deleted = Finish(Claim().claims.at(0), std::nullopt).value();
  EXPECT_TRUE(deleted.is_changed);
  EXPECT_FALSE(store_->ReadTile(kA).value().has_value());
  const StoreCounts counts = store_->ReadCounts().value();
  EXPECT_EQ(counts.tiles, 0u);
  EXPECT_EQ(counts.tile_bytes, 0u);
  EXPECT_EQ(counts.cells, 0u);
}

TEST_F(TileStoreTest, AMarkSetWhileFusingIsNotLost) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA})).has_value());
  const TileClaim claim = Claim().claims.at(0);
  ASSERT_TRUE(Put(MakeKeyframe(2, {kA})).has_value());  // between gathering and finishing
  ASSERT_TRUE(Finish(claim, Content(7)).has_value());
  const ClaimResult again = Claim();
  ASSERT_EQ(again.claims.size(), 1u);
  EXPECT_EQ(again.claims[0].id, kA);
  EXPECT_EQ(again.claims[0].since, 2u);
  EXPECT_EQ(again.claims[0].generation, 2u);
}

TEST_F(TileStoreTest, ALeasedTileIsNotLeasedTwice) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA})).has_value());
  ASSERT_EQ(Claim().claims.size(), 1u);
  const ClaimResult second = Claim(1u << 30, "other");
  EXPECT_TRUE(second.claims.empty());
  EXPECT_FALSE(second.is_wave_done);
}

TEST_F(TileStoreTest, AWorkerThatLostItsLeaseCannotFinish) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA})).has_value());
  const TileClaim slow = Claim().claims.at(0);
  const ClaimResult taken_over = Claim(1u << 30, "other", 1'000'000);
  ASSERT_EQ(taken_over.claims.size(), 1u);
  EXPECT_EQ(Finish(slow, Content(1)).error().code(), StatusCode::kConflict);
  EXPECT_TRUE(Finish(taken_over.claims[0], Content(2)).has_value());
  EXPECT_EQ(Finish(slow, Content(1)).error().code(), StatusCode::kConflict);
  EXPECT_EQ(store_->ReadTile(kA).value()->payload_hash, 2u);
}

TEST_F(TileStoreTest, ParentsWaitForTheirLevel) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA, kB})).has_value());
  const ClaimResult claimed = Claim();
  ASSERT_EQ(claimed.claims.size(), 2u);
  ASSERT_TRUE(Finish(claimed.claims[0], Content(1)).has_value());
  EXPECT_TRUE(Claim().claims.empty());  // the other level-0 tile is still being built
  ASSERT_TRUE(Finish(claimed.claims[1], Content(2)).has_value());
  EXPECT_EQ(Claim().claims.size(), 2u);  // both parents, at once
}

TEST_F(TileStoreTest, AWaveLeavesLaterMarksAlone) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA})).has_value());
  ASSERT_TRUE(Finish(Claim().claims.at(0), Content(1)).has_value());
  ASSERT_TRUE(Put(MakeKeyframe(2, {kB})).has_value());
  const ClaimResult wave = Claim(2);
  ASSERT_EQ(wave.claims.size(), 1u);
  EXPECT_EQ(wave.claims[0].id, kA.Parent());  // although a level-0 tile is dirty meanwhile
}

TEST_F(TileStoreTest, AClaimThatFailedAfterItsTileWasMarkedAgainIsFreeAtOnce) {
  Open();
  const TileId id{0, 1, 1};
  ASSERT_TRUE(Put(MakeKeyframe(0, {id})).has_value());
  const TileClaim old = Claim().claims.at(0);
  ASSERT_TRUE(Put(MakeKeyframe(1, {id})).has_value());
  const auto release = [&](const TileClaim& claim) {
    return Await<bool>([&](auto done) { store_->ReleaseClaim(claim, 5'000, std::move(done)); });
  };
  ASSERT_TRUE(release(old).value());
  EXPECT_TRUE(Dirty().failed_tiles.empty());
  const TileClaim current = Claim().claims.at(0);
  EXPECT_GT(current.generation, old.generation);
  ASSERT_TRUE(release(current).value());
  EXPECT_EQ(Dirty().failed_tiles, std::vector{id});
  const TileId other{0, 2, 2};
  ASSERT_TRUE(Put(MakeKeyframe(2, {other})).has_value());
  EXPECT_TRUE(Dirty().failed_tiles.empty()) << "not all have";
  ASSERT_TRUE(release(Claim().claims.at(0)).value());
  EXPECT_EQ(Dirty().failed_tiles, (std::vector{id, other}));
  EXPECT_TRUE(Claim().claims.empty());
}

TEST_F(TileStoreTest, AReleasedClaimComesBackAtItsTime) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA})).has_value());
  const TileClaim claim = Claim().claims.at(0);
  ASSERT_TRUE(
      Await<bool>([&](auto done) { store_->ReleaseClaim(claim, 5000, std::move(done)); }).value());
  EXPECT_TRUE(Claim().is_wave_done);
  EXPECT_EQ(Dirty().dirty_tiles, 1u);
  EXPECT_EQ(Claim(1u << 30, "w", 5000).claims.size(), 1u);
}

TEST_F(TileStoreTest, MarksSurviveARestartAndLeasesDoNot) {
  Open();
  ASSERT_TRUE(Put(MakeKeyframe(1, {kA, kB})).has_value());
  ASSERT_EQ(Claim().claims.size(), 2u);
  Open();
  EXPECT_EQ(Claim().claims.size(), 2u);
}

TEST_F(TileStoreTest, ScanFindsExactlyTheRectangle) {
  Open();
  std::vector<TileId> footprint;
  for (std::int32_t y = -8; y < 8; ++y) {
    for (std::int32_t x = -8; x < 8; ++x) {
      footprint.push_back({0, x, y});
    }
  }
  ASSERT_TRUE(Put(MakeKeyframe(1, footprint)).has_value());
  for (ClaimResult c = Claim(); !c.claims.empty() && c.claims[0].id.level == 0; c = Claim()) {
    for (const TileClaim& claim : c.claims) {
      ASSERT_TRUE(Finish(claim, Content(1)).has_value());
    }
  }
  const TileRect rect{0, -3, -8, 2, 5};
  std::vector<TileId> seen;
  ASSERT_TRUE(store_->ScanTiles(rect, [&](const TileSummary& t) { seen.push_back(t.id); }).ok());
  EXPECT_EQ(seen.size(), 6u * 14u);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    EXPECT_TRUE(rect.Contains(seen[i]));
    EXPECT_TRUE(i == 0 || seen[i - 1].Key() < seen[i].Key());
  }
  EXPECT_EQ(store_->ListTiles(-1, 1000)->size(), 256u);
  EXPECT_EQ(store_->ListTiles(static_cast<std::int64_t>(seen[0].Key()), 5)->size(), 5u);
  EXPECT_EQ(store_->ListFootprintTiles(0, -1, 1000)->size(), 256u);
}

TEST_F(TileStoreTest, ATileThatIsListedAndNotFoundIsDamagedUntilItIsStoredAgain) {
  LoseTheTile();
  ASSERT_EQ(store_->ListTiles(-1, 10)->size(), 1u);
  EXPECT_EQ(store_->ReadTile(kA).error().code(), StatusCode::kInvalidData);
  EXPECT_EQ(store_->CheckCounters().code(), StatusCode::kInvalidData);
  EXPECT_TRUE(FuseAgain(Content(7))->is_changed);
  EXPECT_EQ(store_->ReadTile(kA).value()->blob, Content(7).blob);
  ExpectTiles(1);
}

TEST_F(TileStoreTest, ATileThatIsListedAndNotFoundIsGoneOnceItIsEmpty) {
  LoseTheTile();
  EXPECT_TRUE(FuseAgain(std::nullopt)->is_changed);
  EXPECT_FALSE(store_->ReadTile(kA).value().has_value());
  ExpectTiles(0);
}

TEST_F(TileStoreTest, WhoRepairsIndexesForgetsNoTileThatTheyList) {
  LoseTheTile();
  const auto repaired = Await<std::uint32_t>(
      [&](auto done) { store_->RepairTables(TableRepair::kRows, "tester", std::move(done)); });
  ASSERT_TRUE(repaired.has_value()) << repaired.error().message();
  EXPECT_EQ(*repaired, 1u);
  EXPECT_EQ(store_->ReadTile(kA).error().code(), StatusCode::kInvalidData);
  ExpectTiles(1);
}

TEST(TileRangesTest, CoverHoldsEveryKeyOfTheRectangle) {
  for (const std::size_t max_ranges : {4u, 16u, 256u}) {
    const TileRect rect{2, -5, 3, 9, 20};
    const auto ranges = CoverRect(rect, max_ranges);
    ASSERT_LE(ranges.size(), max_ranges);
    for (std::int32_t y = rect.min_y; y <= rect.max_y; ++y) {
      for (std::int32_t x = rect.min_x; x <= rect.max_x; ++x) {
        const auto key = static_cast<std::int64_t>(TileId{2, x, y}.Key());
        int holders = 0;
        for (const KeyRange& range : ranges) {
          holders += key >= range.first && key <= range.last ? 1 : 0;
        }
        EXPECT_EQ(holders, 1) << x << ' ' << y;
      }
    }
  }
  EXPECT_EQ(CoverRect({3}, 4), std::vector<KeyRange>{LevelRange(3)});
  for (std::uint8_t level = 0; level < 31; ++level) {
    EXPECT_EQ(LevelRange(level).last + 1, LevelRange(level + 1).first);
  }
  EXPECT_EQ(LevelRange(31).last, std::numeric_limits<std::int64_t>::max());
}

TEST(TileRangesTest, ShardsAreCoarseRegions) {
  EXPECT_EQ(ShardOf({0, 5, 9}), ShardOf({0, 1023, 1023}));
  EXPECT_NE(ShardOf({0, 1023, 0}), ShardOf({0, 1024, 0}));
  EXPECT_NE(ShardOf({0, -1, 0}), ShardOf({0, 0, 0}));
  EXPECT_EQ(ShardOf({0, 1024, 0}), ShardOf({3, 128, 0}));
}

}  // namespace
}  // namespace atlas
