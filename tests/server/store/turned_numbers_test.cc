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

TEST_F(TurnedNumbersTest, UploadsGoOnBesideAKeyframeThatHasTheNextOne) {
  FillUp();
  Turn("keyframes", kLast, 1);
  Open();
  const auto put = Put(MakeKeyframe(kLast + 2, {{0, 1, 2}}));
  ASSERT_TRUE(put) << put.error().message();
  EXPECT_GE(Repair(), 1U);
  EXPECT_EQ(store_->ListKeyframeIds(0, 100)->size(), kLast + 1);
  ExpectKeyframe(kLast);
  ExpectKeyframe(kLast + 2);
  ExpectNothingLeft();
}

TEST_F(TurnedNumbersTest, SessionsBeginBesideOneThatHasTheNextOne) {
  FillUp();
  NewKeyframe other = MakeKeyframe(1, {{0, 1, 2}});
  other.key.session.session = "night";
  ASSERT_TRUE(Put(other));
  Turn("sessions", 2, 1);
  Open();
  other.key.session.session = "morning";
  const auto put = Put(other);
  ASSERT_TRUE(put) << put.error().message();
  EXPECT_GE(Repair(), 1U);
  std::vector<std::string> names;
  const auto sessions = store_->ListSessions({}, 10).value();
  for (const SessionRecord& session : sessions) {
    names.push_back(session.key.session);
  }
  EXPECT_THAT(names, ElementsAre("day", "morning", "night"));
  ExpectNothingLeft();
}

// Whatever is to be noted: by who retracts, who starts with something to mend, and who repairs.
TEST_F(TurnedNumbersTest, EventsAreNotedBesideOneThatHasTheNextOne) {
  FillUp();
  for (std::int64_t i = 1; i <= 3; ++i) {
    ASSERT_TRUE(Correct(i));
  }
  ASSERT_TRUE(Change(SessionAction::kRetract));
  Turn("events", 4, 1);
  Tamper("UPDATE counters SET checksum = 0 WHERE name = 'tiles'");
  testing::TurnNumber(Database(), "pose_batches", 2, 64);
  Open();
  const auto restored = Change(SessionAction::kRestore);
  ASSERT_TRUE(restored) << restored.error().message();
  EXPECT_GE(Repair(), 2U);
  ExpectNothingLeft();
  const auto events = store_->ListEvents(0, 100).value();
  ASSERT_GT(events.size(), 5U);
  EXPECT_EQ(events[3].id, 4U);
  EXPECT_EQ(events[3].kind, EventKind::kRetract);
  EXPECT_TRUE(std::any_of(events.begin(), events.end(),
                          [](const Event& event) { return event.kind == EventKind::kRestore; }));
}

TEST_F(TurnedNumbersTest, CompactionsGoOnBesideOneThatHasTheNextOne) {
  FillUp();
  for (const std::int64_t id : {1, 2}) {
    ASSERT_TRUE(Compact({id}));
  }
  Turn("compactions", 2, 1);
  Open();
  const auto compacted = Compact({3});
  ASSERT_TRUE(compacted) << compacted.error().message();
  ExpectNothingLeft();
  const auto events = store_->ListEvents(0, 100).value();
  for (const Event& event : events) {
    EXPECT_EQ(event.kind, EventKind::kCompact) << event.detail;
  }
}

// A repair moves the horizon before it comes to compactions.
TEST_F(TurnedNumbersTest, SoDoesARepair) {
  FillUp();
  for (const std::int64_t id : {1, 2}) {
    ASSERT_TRUE(Compact({id}));
  }
  Turn("compactions", 2, 1);
  Tamper("UPDATE session_states SET checksum = 0");
  Open();
  EXPECT_GE(Repair(), 2U);
  ExpectNothingLeft();
}

TEST_F(TurnedNumbersTest, CorrectionsGoOnBesideABatchThatHasTheNextOne) {
  FillUp();
  for (const std::int64_t x_um : {1, 2}) {
    ASSERT_TRUE(Correct(x_um));
  }
  Turn("pose_batches", 2, 1);
  Open();
  const auto corrected = Correct(3);
  ASSERT_TRUE(corrected) << corrected.error().message();
  EXPECT_GE(Repair(), 1U);
  ExpectNothingLeft();
}

// The index of marks still has what the row was.
TEST_F(TurnedNumbersTest, TheMarkOfAnotherTileIsSetAgainByAStart) {
  FillUp();
  store_.reset();
  const auto key = testing::AskDatabase(Database(), "SELECT key FROM dirty_tiles WHERE level = 0");
  Turn("dirty_tiles", static_cast<std::uint64_t>(key), 1);
  Open();
  const ClaimResult claimed = Claim();
  ASSERT_FALSE(claimed.claims.empty());
  EXPECT_EQ(claimed.claims.front().id, (TileId{0, 1, 2}));
  ExpectNothingLeft();
}

// What was dropped has no other number than that of the keyframe.
TEST_F(TurnedNumbersTest, WhoMeetsARowThatHasItsKeyIsToldWhatHelps) {
  FillUp();
  ASSERT_TRUE(Compact({2}));
  Tamper("UPDATE tombstones SET sequence = 6");
  Open();
  const auto compacted = Compact({6});
  ASSERT_FALSE(compacted);
  EXPECT_EQ(compacted.error().code(), StatusCode::kInvalidData);
  EXPECT_THAT(compacted.error().message(), HasSubstr("(SQLite 1555); atlas verify --repair"));
  EXPECT_GE(Repair(), 1U);
  EXPECT_TRUE(Compact({6}));
}

// Its blobs were in the pages of the table that was written anew.
TEST_F(TurnedNumbersTest, APurgeBehindARepairLeavesNothing) {
  Fill();
  Turn("keyframes", 3, 8);  // 11, before 4
  Open();
  EXPECT_FALSE(Check().ok());
  EXPECT_GE(Repair(), 1U);
  EXPECT_EQ(Check().message(), "");
  const auto purged = Change(SessionAction::kPurge);
  ASSERT_TRUE(purged) << purged.error().message();
  EXPECT_EQ(purged->keyframes, kCount);
  store_.reset();
  EXPECT_EQ(InTheFiles(Secret()), 0U);
  EXPECT_GT(InTheFiles("of the night"), 1'000U);
}

// One of two of a name that an index had lost, whose other one was purged meanwhile.
TEST_F(TurnedNumbersTest, NorDoesARepairThatPurges) {
  Fill();
  store_.reset();
  testing::TurnBits(Database(), "sqlite_autoindex_sessions_1", "busday", 0, 32);
  Open();
  ASSERT_TRUE(Put(Large(kCount + 1)));
  ASSERT_TRUE(Change(SessionAction::kPurge));
  EXPECT_GE(Repair(), 1U);
  EXPECT_EQ(store_->ListSessions({}, 10)->size(), 2U);
  EXPECT_TRUE(IsSoonGone(Secret()));
  ExpectSound();
}

}  // namespace
}  // namespace atlas
