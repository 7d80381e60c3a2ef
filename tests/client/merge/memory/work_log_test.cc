// Records come back in their order; of what a write that never ended left nothing does, and the
// next ones follow what was whole.
#include "client/merge/memory/work_log.h"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "client/vehicle/stored_file.h"
#include "tests/client/vehicle/test_folder.h"

namespace atlas {
namespace {

using ::testing::ElementsAre;

class WorkLogTest : public ::testing::Test {
 protected:
  std::filesystem::path File() const { return folder_.path() / "log"; }

  // Those that are there, and then `more`.
  std::vector<std::string> Records(const std::vector<std::string>& more = {},
                                   const std::optional<std::string>& last = std::nullopt) {
    std::vector<std::string> records;
    auto log = WorkLog::Open(File(), [&](ByteSpan record) {
      records.emplace_back(record.begin(), record.end());
      if (!last || records.back() != *last) return true;
      records.pop_back();
      return false;
    });
    EXPECT_TRUE(log.has_value());
    for (const std::string& record : more) {
      EXPECT_TRUE(
          log->Append({reinterpret_cast<const std::uint8_t*>(record.data()), record.size()}).ok());
    }
    return records;
  }

  Bytes Content() const { return LoadFile(File(), 1U << 20U).value(); }
  void Write(const Bytes& bytes) const {
    ASSERT_TRUE(StoreFile(File(), bytes, Durability::kWhole).ok());
  }

  TestFolder folder_;
};

TEST_F(WorkLogTest, RecordsComeBackInTheirOrder) {
  EXPECT_THAT(Records({"one", "", "three"}), ElementsAre());
  EXPECT_THAT(Records({"four"}), ElementsAre("one", "", "three"));
  EXPECT_THAT(Records(), ElementsAre("one", "", "three", "four"));
}

TEST_F(WorkLogTest, CutAnywhereItGoesOnFromWhatIsWhole) {
  Records({"one", "two"});
  const Bytes whole = Content();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    Write(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)));
    const auto left = Records({"next"});
    EXPECT_LT(left.size(), 2U);
    std::vector<std::string> expected = left;
    expected.emplace_back("next");
    EXPECT_EQ(Records(), expected);
  }
}

TEST_F(WorkLogTest, NoTurnedBitIsARecord) {
  Records({"one", "two"});
  const Bytes whole = Content();
  for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
    Bytes turned = whole;
    turned[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    Write(turned);
    const auto left = Records();
    EXPECT_EQ(left, bit / 8 < whole.size() / 2 ? std::vector<std::string>()
                                               : std::vector<std::string>{"one"});
  }
}

TEST_F(WorkLogTest, WhatItsReaderDoesNotKnowEndsIt) {
  Records({"one", "two", "three"});
  EXPECT_THAT(Records({}, "two"), ElementsAre("one"));
  EXPECT_THAT(Records(), ElementsAre("one"));
}

TEST_F(WorkLogTest, AFullDiskIsTold) {
  auto log = WorkLog::Open("/dev/full", [](ByteSpan) { return true; });
  ASSERT_TRUE(log.has_value());
  const Bytes record(1U << 20U);
  EXPECT_EQ(log->Append(record).code(), StatusCode::kResourceExhausted);
}

}  // namespace
}  // namespace atlas
