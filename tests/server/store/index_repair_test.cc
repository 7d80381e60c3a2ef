// Indexes that have something else than their tables: each is found, and made anew where the rows
// are whole. Where they are not, nothing is made of them.
#include <fstream>

#include <gmock/gmock.h>

#include "tests/server/store/lost_rows.h"
#include "tests/server/store/store_fixture.h"
#include "tests/server/store/turned_bits.h"

namespace atlas {
namespace {

using ::testing::HasSubstr;

class IndexRepairTest : public StoreTest {
 protected:
  // Every index has rows; tiles of two levels, all fused but for one mark.
  void Live() {
    Open();
    for (std::uint32_t sequence = 1; sequence <= 4; ++sequence) {
      ASSERT_TRUE(Put(MakeKeyframe(sequence, {{0, 1, 2}, {0, 2, 2}})));
    }
    Build();
    ASSERT_TRUE(Await<CompactionResult>([&](auto done) {
      store_->Compact({Dirty().revision, 5'000, {1}, "tester"}, std::move(done));
    }));
    NewKeyframe leap = MakeKeyframe(1, {{0, 9, 9}});
    leap.key.session.session = "leap";
    ASSERT_TRUE(Put(leap));
    Build();
    tiles_ = store_->ListTiles(-1, 100)->size();
    ASSERT_TRUE(Await<std::uint32_t>([&](auto done) {
      store_->MarkDirty({{0, 9, 9}}, std::move(done));
    }));
  }
  void Build() {
    for (ClaimResult claimed = Claim(); !claimed.claims.empty(); claimed = Claim()) {
      for (const TileClaim& claim : claimed.claims) {
        ASSERT_TRUE(Finish(claim, Content(7)));
      }
    }
  }
  Status Check() {
    return store_->CheckIndexes([] { return Status(); });
  }
  Result<std::uint32_t> Repair(TableRepair what = TableRepair::kIndexes) {
    return Await<std::uint32_t>(
        [&](auto done) { store_->RepairTables(what, "tester", std::move(done)); });
  }

  std::size_t tiles_ = 0;
};

struct LostIndex {
  const char* index;
  const char* statements;  // that it misses
};

constexpr LostIndex kLost[] = {
    {"tiles_of_keyframe",
     "DELETE FROM keyframe_tiles WHERE keyframe_id = 2 AND tile_key = "
     "(SELECT min(tile_key) FROM keyframe_tiles)"},
    {"tiles_of_keyframe", "UPDATE keyframe_tiles SET keyframe_id = 99 WHERE keyframe_id = 2"},
    {"changes_of_tile", "DELETE FROM keyframe_tiles WHERE keyframe_id = 2"},
    {"changes_of_tile", "UPDATE keyframe_tiles SET is_current = 0 WHERE keyframe_id = 2"},
    {"tile_summaries", "UPDATE tiles SET cells = cells + 1"},
    {"dirty_since", "UPDATE dirty_tiles SET since = since + 1"},
    {"quarantined_sessions", "UPDATE sessions SET state = 2 WHERE session = 'leap'"},
    {"tombstones_of_compaction", "UPDATE tombstones SET compaction_id = 9"},
    {"tombstones_of_compaction", "DELETE FROM tombstones"},
};

TEST_F(IndexRepairTest, EachIsLookedAt) {
  for (const LostIndex& lost : kLost) {
    SCOPED_TRACE(std::string(lost.index) + ": " + lost.statements);
    Live();
    ASSERT_TRUE(Check().ok()) << Check().message();
    store_.reset();
    // Without who would put rows right before the look: as if it had happened since.
    Open();
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(Database().c_str(), &db), SQLITE_OK);
    char* message = nullptr;
    ASSERT_EQ(sqlite3_exec(db, testing::WithoutIndex(lost.index, lost.statements).c_str(), nullptr,
                           nullptr, &message),
              SQLITE_OK)
        << message;
    sqlite3_close(db);
    EXPECT_THAT(Check().message(),
                HasSubstr("the index " + std::string(lost.index) + " is damaged"));
    store_.reset();
    std::filesystem::remove_all(options_.directory);
  }
}

// Nobody knows what was fused by it.
TEST_F(IndexRepairTest, EveryTileIsFusedAgainByOneThatWasMadeAnew) {
  Live();
  ASSERT_EQ(Dirty().dirty_tiles, 1U);
  store_.reset();
  testing::TurnBits(Database(), "sqlite_autoindex_keyframes_1", {4, 9, 1, 1, 3, 3}, 4, 64);
  Open();
  ASSERT_FALSE(Check().ok());
  const auto repaired = Repair();
  ASSERT_TRUE(repaired) << repaired.error().message();
  EXPECT_TRUE(Check().ok()) << Check().message();
  EXPECT_GT(tiles_, 3U);
  EXPECT_GE(Dirty().dirty_tiles, tiles_);
  EXPECT_EQ(Dirty().oldest_since, kReflectsNothing) << "they reflect nothing for sure";
}

// What to do about it is said where it is met: an index can be made anew, a page cannot.
TEST_F(IndexRepairTest, WhoMeetsOneIsToldWhatHelps) {
  Live();
  store_.reset();
  testing::TurnBits(Database(), "sqlite_autoindex_keyframes_1", {4, 9, 1, 1, 3, 3}, 4, 64);
  Open();
  const auto compact = [this] {
    return Await<CompactionResult>([this](auto done) {
      store_->Compact({Dirty().revision, 5'000, {3}, "tester"}, std::move(done));
    });
  };
  const auto lacking = compact();
  ASSERT_FALSE(lacking);
  EXPECT_THAT(lacking.error().message(), HasSubstr("(SQLite 779); atlas verify --repair"));
  ASSERT_TRUE(Repair());
  EXPECT_TRUE(compact());

  store_.reset();
  const std::size_t page = testing::RootPage(Database(), "sqlite_autoindex_keyframes_1");
  std::fstream file(Database(), std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(static_cast<std::streamoff>((page - 1) * testing::kPageBytes));
  file << std::string(testing::kPageBytes, '\0');
  file.close();
  Open();
  const auto gone = Put(MakeKeyframe(7, {{0, 1, 2}}));
  ASSERT_FALSE(gone);
  EXPECT_EQ(gone.error().code(), StatusCode::kInvalidData);
  EXPECT_THAT(gone.error().message(), HasSubstr("; restore a backup"));
}

// The table has the damage, and an index what was there.
TEST_F(IndexRepairTest, AFootprintThatIsDamagedComesBackFromItsIndex) {
  for (const TableRepair what : {TableRepair::kIndexes, TableRepair::kRows}) {
    Live();
    Tamper(testing::WithoutIndex(
        "changes_of_tile",
        "UPDATE keyframe_tiles SET revision = revision + 1 WHERE keyframe_id = 3"));
    Open();
    EXPECT_FALSE(store_->ReadKeyframe(3));
    ASSERT_FALSE(Check().ok());
    const auto repaired = Repair(what);
    ASSERT_TRUE(repaired) << repaired.error().message();
    EXPECT_TRUE(Check().ok()) << Check().message();
    const auto keyframe = store_->ReadKeyframe(3);
    ASSERT_TRUE(keyframe) << keyframe.error().message();
    EXPECT_EQ(keyframe->footprint.size(), 2U);
    EXPECT_TRUE(store_->CheckCounters().ok()) << store_->CheckCounters().message();
    store_.reset();
    std::filesystem::remove_all(options_.directory);
  }
}

// It would be gone.
TEST_F(IndexRepairTest, OfAFootprintThatIsWholeNowhereNoIndexIsMadeAnew) {
  Live();
  Tamper("UPDATE keyframe_tiles SET revision = revision + 1 WHERE keyframe_id = 3");
  const std::int64_t rows = testing::AskDatabase(Database(), "SELECT count(*) FROM keyframe_tiles");
  Open();
  const auto repaired = Repair();
  ASSERT_FALSE(repaired);
  EXPECT_EQ(repaired.error().code(), StatusCode::kInvalidData);
  EXPECT_THAT(repaired.error().message(), HasSubstr("keyframe_tiles"));
  store_.reset();
  EXPECT_EQ(testing::AskDatabase(Database(), "SELECT count(*) FROM keyframe_tiles"), rows);
}

}  // namespace
}  // namespace atlas
