// What a transaction leaves for its end is there before anybody reads it, and is gone with whatever
// gave it up.
#include "server/store/sqlite/connection/deferred.h"

#include <memory>

#include "server/store/sqlite/schema/row_hash.h"
#include "server/store/sqlite/schema/table_sums.h"
#include "server/store/sqlite/tables/dirty_table.h"
#include "tests/server/store/store_fixture.h"

namespace atlas {
namespace {

constexpr TileId kTile{0, 1, 1};
constexpr TileId kOther{0, 2, 2};

class DeferredTest : public StoreTest {
 protected:
  DeferredTest() {
    Open();
    store_.reset();
    connection_ = std::make_unique<Connection>(
        DatabaseOptions{Database(), DatabaseOptions::Mode::kReadWrite, 1024, 5'000});
    AddRowHash(*connection_);
    KeepTableSums(*connection_);
    MarkAtTheEnd(*connection_);
  }

  std::int64_t Marks() { return connection_->Ask("SELECT count(*) FROM dirty_tiles"); }
  // What another connection sees.
  ClaimResult Commit() {
    connection_->Commit();
    EXPECT_TRUE(CheckTableSums(*connection_).ok());
    connection_->Begin();
    auto claims = ClaimTiles(*connection_, {"reader", 0, 60'000, 100, 100});
    EXPECT_TRUE(claims.has_value());
    connection_->RollBack();
    return *std::move(claims);
  }

  std::unique_ptr<Connection> connection_;
};

TEST_F(DeferredTest, ATileThatIsMarkedAgainIsMarkedOnce) {
  connection_->Begin();
  MarkTile(*connection_, kTile, 5, 5);
  MarkTile(*connection_, kOther, 6, 6);
  MarkTile(*connection_, kTile, 7, 7);
  EXPECT_EQ(Marks(), 0);
  const ClaimResult result = Commit();
  ASSERT_EQ(result.claims.size(), 2u);
  EXPECT_EQ(result.claims[0].id, kTile);
  EXPECT_EQ(result.claims[0].generation, 7u);
  EXPECT_EQ(result.claims[0].since, 5u);
  EXPECT_EQ(result.claims[1].generation, 6u);
}

// Whoever claims a tile sees the marks before it, and not those behind it.
TEST_F(DeferredTest, WhoReadsMarksSeesThem) {
  connection_->Begin();
  MarkTile(*connection_, kTile, 5, 5);
  const auto claims = ClaimTiles(*connection_, {"worker", 0, 60'000, 100, 100});
  ASSERT_TRUE(claims && claims->claims.size() == 1);
  MarkTile(*connection_, kTile, 6, 6);
  SettleClaim(*connection_, claims->claims[0]);
  const ClaimResult result = Commit();
  ASSERT_EQ(result.claims.size(), 1u) << "marked since it was claimed";
  EXPECT_EQ(result.claims[0].generation, 6u);
  EXPECT_EQ(result.claims[0].since, 6u);
}

TEST_F(DeferredTest, WhatASavepointGivesUpNeverWas) {
  for (const bool is_read : {true, false}) {
    connection_->Begin();
    MarkTile(*connection_, kTile, 5, 5);
    if (is_read) {
      EXPECT_EQ(ReadDirty(*connection_).dirty_tiles, 1u);
    }
    connection_->Save();
    MarkTile(*connection_, kTile, 6, 1);
    MarkTile(*connection_, kOther, 6, 6);
    if (is_read) {
      EXPECT_EQ(ReadDirty(*connection_).dirty_tiles, 2u);
      EXPECT_TRUE(CheckTableSums(*connection_).ok());
    }
    connection_->RestoreSaved();
    connection_->ReleaseSaved();
    const ClaimResult result = Commit();
    ASSERT_EQ(result.claims.size(), 1u);
    EXPECT_EQ(result.claims[0].generation, 5u);
    EXPECT_EQ(result.claims[0].since, 5u);
  }
}

TEST_F(DeferredTest, WhatATransactionGivesUpNeverWas) {
  connection_->Begin();
  MarkTile(*connection_, kTile, 5, 5);
  EXPECT_EQ(ReadDirty(*connection_).dirty_tiles, 1u);
  MarkTile(*connection_, kOther, 6, 6);
  connection_->RollBack();
  connection_->Begin();
  EXPECT_TRUE(Commit().claims.empty());
}

TEST_F(DeferredTest, MoreThanAreKeptAreWritten) {
  constexpr std::int32_t kTiles = 70'000;
  connection_->Begin();
  for (std::int32_t x = 0; x < kTiles; ++x) {
    MarkTile(*connection_, {0, x, 0}, 5, 5);
  }
  EXPECT_GT(Marks(), 0);
  connection_->Save();
  MarkTile(*connection_, kOther, 5, 5);
  connection_->RestoreSaved();
  connection_->ReleaseSaved();
  connection_->Commit();
  EXPECT_EQ(Marks(), kTiles);
  EXPECT_TRUE(CheckTableSums(*connection_).ok());
}

// They would be missed.
TEST_F(DeferredTest, NoRowIsWrittenWithoutATransaction) {
  EXPECT_ANY_THROW(
      connection_->Execute("INSERT INTO dirty_tiles (key, shard, level, generation, since, "
                           "checksum) VALUES (1, 0, 0, 1, 1, 1)"));
  EXPECT_EQ(Marks(), 0);
}

}  // namespace
}  // namespace atlas
