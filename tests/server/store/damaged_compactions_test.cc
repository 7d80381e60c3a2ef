// What tells of compactions, of starts and of batches of corrections, while rows of it are damaged
// or gone: a repair leaves nothing that is found again, and the atlas goes on.
#include <gmock/gmock.h>

#include "tests/server/store/store_fixture.h"
#include "tests/server/store/turned_numbers.h"

namespace atlas {
namespace {

class DamagedCompactionsTest : public StoreTest {
 protected:
  Result<CompactionResult> Compact(std::vector<std::int64_t> ids) {
    Compaction compaction{Dirty().revision, 5'000, std::move(ids), "tester"};
    return Await<CompactionResult>(
        [&](auto done) { store_->Compact(std::move(compaction), std::move(done)); });
  }
  // Three compactions of one session, a correction after each, and a start before each.
  void Live() {
    for (std::uint32_t i = 1; i <= 3; ++i) {
      Open();
      ASSERT_TRUE(Put(MakeKeyframe(2 * i - 1, {{0, 1, 2}})));
      ASSERT_TRUE(Put(MakeKeyframe(2 * i, {{0, 1, 2}})));
      ASSERT_TRUE(Compact({2 * i - 1}));
      ASSERT_TRUE(Update({{{{"bus", "day"}, 2 * i}, PoseAt(i), {{0, 1, 2}}}}));
    }
  }
  std::string Findings() {
    std::string text;
    for (const Status& status : {store_->CheckCounters(), store_->CheckCompactions(),
                                 store_->CheckSession({"bus", "day"})}) {
      text += status.ok() ? "" : status.message() + "; ";
    }
    return text;
  }
};

TEST_F(DamagedCompactionsTest, ARepairLeavesNothingThatIsFoundAgain) {
  for (const char* const damage :
       {"UPDATE tombstones SET blob_hash = 1 WHERE sequence = 1",
        "UPDATE tombstones SET compaction_id = 7 WHERE sequence = 3",
        "UPDATE tombstones SET sequence = 2 WHERE sequence = 3", "DELETE FROM tombstones",
        "UPDATE compactions SET author = 'x' WHERE id = 1",
        "UPDATE compactions SET author = 'x' WHERE id = 3",
        "UPDATE compactions SET dropped = 9 WHERE id = 2",
        "UPDATE compactions SET revision = 1000000 WHERE id = 2",
        "UPDATE compactions SET id = 66 WHERE id = 2", "UPDATE compactions SET id = 6 WHERE id = 3",
        "DELETE FROM compactions WHERE id = 1", "DELETE FROM compactions",
        "UPDATE starts SET id = zeroblob(16) WHERE number = 2",
        "UPDATE starts SET number = number + 64 WHERE number = 3",
        "UPDATE pose_batches SET id = id + 64 WHERE id = 3",
        "UPDATE pose_batches SET id = id + 64, author = 'x' WHERE id = 3",
        "UPDATE sessions SET id = 65", "UPDATE keyframes SET id = 70 WHERE id = 6"}) {
    SCOPED_TRACE(damage);
    store_.reset();
    std::filesystem::remove_all(options_.directory);
    Live();
    ASSERT_EQ(Findings(), "");
    Tamper(damage);
    Open();
    EXPECT_NE(Findings(), "");
    EXPECT_GE(Repair(), 1U);
    EXPECT_EQ(Findings(), "");
    EXPECT_EQ(Repair(), 0U);
    EXPECT_EQ(store_->ListSessions({}, 10)->size(), 1U);
    ASSERT_TRUE(Put(MakeKeyframe(9, {{0, 1, 2}})));
    const auto compacted = Compact({4});
    EXPECT_TRUE(compacted) << compacted.error().message();
    EXPECT_TRUE(Update({{{{"bus", "day"}, 6}, PoseAt(77), {{0, 1, 2}}}}));
    EXPECT_EQ(Findings(), "");
  }
}

// Of a compaction the checksum tells what one bit of its number was, and the number of batches.
TEST_F(DamagedCompactionsTest, ANumberWithATurnedBitComesBackWithAllThatStandsThere) {
  Live();
  Tamper(
      "CREATE TABLE was AS SELECT 'c' || id || author || revision || dropped AS line FROM "
      "compactions UNION ALL SELECT 'b' || id || author || revision FROM pose_batches;"
      "UPDATE compactions SET id = 66 WHERE id = 2;"
      "UPDATE pose_batches SET id = 67 WHERE id = 3");
  Open();
  EXPECT_GE(Repair(), 2U);
  Tamper(
      "CREATE TABLE is_now AS SELECT 'c' || id || author || revision || dropped AS line FROM "
      "compactions UNION ALL SELECT 'b' || id || author || revision FROM pose_batches;"
      "CREATE TABLE same (ok CHECK (ok));"
      "INSERT INTO same SELECT count(*) = 6 FROM is_now NATURAL JOIN was");
}

// The second of three batches: a bit of its number, so that it is out of order and not found.
TEST_F(DamagedCompactionsTest, ARowOutOfOrderGetsItsPlaceBack) {
  Live();
  store_.reset();
  testing::TurnBits(Database(), "pose_batches", {0x16, 2, 7, 0, 1, 0x19}, 1, 64);
  Open();
  EXPECT_NE(store_->CheckIndexes([] { return Status(); }).message().find("table pose_batches"),
            std::string::npos);
  EXPECT_GE(Repair(), 1U);
  EXPECT_EQ(Findings(), "");
  EXPECT_TRUE(store_->CheckIndexes([] { return Status(); }).ok());
  EXPECT_EQ(Repair(), 0U);
  ASSERT_TRUE(Update({{{{"bus", "day"}, 6}, PoseAt(77), {{0, 1, 2}}}}));  // counted as ever
  EXPECT_EQ(Findings(), "");
  store_.reset();
  EXPECT_EQ(testing::AskDatabase(Database(), "SELECT group_concat(id, '') FROM pose_batches"),
            1234);
}

// The table takes none without what each has: here one says of a coordinate, 0, that it is none.
TEST_F(DamagedCompactionsTest, ARowThatATableWrittenAnewDoesNotTakeIsNoted) {
  Live();
  store_.reset();
  testing::TurnNumber(Database(), "pose_history", 5, 64);
  testing::TurnBits(Database(), "pose_history", {14, 0, 1, 1, 9, 0x19, 9, 8, 8}, 7, 8);
  Open();
  EXPECT_GE(Repair(), 1U);
  EXPECT_EQ(Findings(), "");
  std::string noted;
  const auto events = store_->ListEvents(0, 100).value();
  for (const Event& event : events) {
    noted += event.subject == "table pose_history" ? event.detail : "";
  }
  EXPECT_THAT(noted, ::testing::HasSubstr("without 1 of its rows"));
}

// What was dropped at its revision can be read at no earlier one.
TEST_F(DamagedCompactionsTest, TheHorizonStaysWhereTheLastOneWas) {
  for (const char* const damage :
       {"DELETE FROM compactions WHERE id = 3", "UPDATE compactions SET author = 'x' WHERE id = 3",
        "DELETE FROM compactions WHERE id = 2"}) {
    SCOPED_TRACE(damage);
    store_.reset();
    std::filesystem::remove_all(options_.directory);
    Live();
    store_.reset();
    const auto horizon = static_cast<std::uint64_t>(
        testing::AskDatabase(Database(), "SELECT max(revision) FROM compactions"));
    Tamper(damage);
    Open();
    Repair();
    EXPECT_EQ(Findings(), "");
    EXPECT_TRUE(store_->CheckRevision(horizon).ok());
    EXPECT_EQ(store_->CheckRevision(horizon - 1).code(), StatusCode::kNotFound);
    store_.reset();
    EXPECT_GE(testing::AskDatabase(Database(), "SELECT min(revision) FROM compactions"), 3);
  }
}

// Of what nobody tells any more.
TEST_F(DamagedCompactionsTest, WhatADamagedTombstoneStoodForIsStoredAnew) {
  Live();
  EXPECT_TRUE(Put(MakeKeyframe(1, {{0, 1, 2}}))->is_duplicate);
  Tamper("UPDATE tombstones SET blob_hash = 1 WHERE sequence = 1");
  Open();
  EXPECT_FALSE(Put(MakeKeyframe(1, {{0, 1, 2}})));
  Repair();
  const auto stored = Put(MakeKeyframe(1, {{0, 1, 2}}));
  ASSERT_TRUE(stored) << stored.error().message();
  EXPECT_FALSE(stored->is_duplicate);
  EXPECT_EQ(Findings(), "");
}

}  // namespace
}  // namespace atlas
