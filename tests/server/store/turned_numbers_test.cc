// Rows whose numbers have a turned bit, while all indexes and counters are as they were: nothing is
// lost by it, and what is written meanwhile goes beside them.
#include "tests/server/store/turned_numbers.h"

#include <algorithm>

#include <gmock/gmock.h>

#include "tests/server/store/purge_fixture.h"

namespace atlas {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class TurnedNumbersTest : public PurgeTest {
 protected:
  static constexpr std::uint32_t kLast = 30;

  // Keyframes whose sequence numbers are their ids.
  void FillUp() {
    Open();
    for (std::uint32_t i = 1; i <= kLast; ++i) {
      ASSERT_TRUE(Put(MakeKeyframe(i, {{0, 1, 2}})));
    }
  }
  void Turn(const std::string& table, std::uint64_t number, std::uint8_t mask) {
    store_.reset();
    testing::TurnNumber(Database(), table, number, mask);
  }
  Status Check() {
    return store_->CheckIndexes([] { return Status(); });
  }
  std::uint32_t Repair() {
    std::uint32_t repaired = 0;
    for (const TableRepair what : {TableRepair::kRows, TableRepair::kSums}) {
      const auto result = Await<std::uint32_t>(
          [&](auto done) { store_->RepairTables(what, "tester", std::move(done)); });
      EXPECT_TRUE(result) << result.error().message();
      repaired += result.value_or(0U);
    }
    return repaired;
  }
  Result<CompactionResult> Compact(std::vector<std::int64_t> ids) {
    return Await<CompactionResult>([&](auto done) {
      store_->Compact({Dirty().revision, 5'000, std::move(ids), "tester"}, std::move(done));
    });
  }
  Result<PoseBatchResult> Correct(std::int64_t x_um) {
    return Update({{{{"bus", "day"}, 6}, PoseAt(x_um), {{0, 1, 2}}}});
  }
  // As its own keyframe says it, which its blob names.
  void ExpectKeyframe(std::int64_t id) {
    const auto keyframe = store_->ReadKeyframe(id);
    ASSERT_TRUE(keyframe) << keyframe.error().message();
    EXPECT_EQ(keyframe->record.key.sequence, id);
    const auto blob = store_->ReadKeyframeBlob(id);
    ASSERT_TRUE(blob) << blob.error().message();
    EXPECT_EQ(blob->back(), id);
  }
  void ExpectNothingLeft() {
    EXPECT_EQ(Check().message(), "");
    for (const Status& status : {store_->CheckCounters(), store_->CheckCompactions(),
                                 store_->CheckSession({"bus", "day"})}) {
      EXPECT_EQ(status.message(), "");
    }
    EXPECT_EQ(Repair(), 0U);
  }
};

// The index still has its key under the number that it had.
TEST_F(TurnedNumbersTest, AKeyframeGetsItsOwnBack) {
  FillUp();
  ASSERT_TRUE(Compact({11}));
  for (const auto& [number, mask] : {std::pair{kLast, 1}, {10U, 1}}) {
    SCOPED_TRACE(number);
    Turn("keyframes", number, static_cast<std::uint8_t>(mask));
    Open();
    EXPECT_FALSE(Check().ok());
    EXPECT_EQ(Repair(), 1U);
    EXPECT_EQ(store_->ListKeyframeIds(0, 100)->size(), kLast - 1);
    ExpectKeyframe(number);
    ExpectNothingLeft();
  }
}

// Of two numbers that would fit between its neighbours.
TEST_F(TurnedNumbersTest, AKeyframeOutOfOrderGetsItsOwnBack) {
  FillUp();
  ASSERT_TRUE(Compact({11, 12, 13, 14, 15, 16, 17, 18}));
  Turn("keyframes", 10, 16);  // 26; 18 would fit, too
  Open();
  EXPECT_FALSE(Check().ok());
  EXPECT_GE(Repair(), 1U);
  EXPECT_EQ(store_->ListKeyframeIds(0, 100)->size(), kLast - 8);
  ExpectKeyframe(10);
  ExpectKeyframe(26);
  ExpectNothingLeft();
}

// So has that of names, and nothing of the session is lost: neither its history nor its keyframes.
TEST_F(TurnedNumbersTest, ASessionGetsItsOwnBack) {
  FillUp();
  NewKeyframe night = MakeKeyframe(kLast + 1, {{0, 1, 2}});
  night.key.session.session = "night";
  ASSERT_TRUE(Put(night));
  Turn("sessions", 2, 4);  // 6
  Open();
  EXPECT_EQ(Check().code(), StatusCode::kInvalidData);
  EXPECT_FALSE(Await<std::uint32_t>([&](auto done) {
    store_->RepairTables(TableRepair::kIndexes, "tester", std::move(done));
  })) << "the index alone tells what it was";
  EXPECT_EQ(Repair(), 1U);
  ExpectNothingLeft();
  EXPECT_EQ(store_->CheckSession({"bus", "night"}).message(), "");
  ExpectKeyframe(kLast + 1);
  EXPECT_EQ(store_->ReadKeyframe(kLast + 1)->record.key.session.session, "night");
  const auto events = store_->ListEvents(0, 100).value();
  EXPECT_TRUE(events.empty()) << events.back().detail;
}

}  // namespace
}  // namespace atlas
