// Who did what, while rows of it are damaged: it is noticed, and a repair tells as much as is left.
#include <gmock/gmock.h>

#include "tests/server/store/store_fixture.h"

namespace atlas {
namespace {

using ::testing::HasSubstr;

class DamagedEventsTest : public StoreTest {
 protected:
  void Spoil(const std::string& sql) {
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(Database().c_str(), &db), SQLITE_OK);
    sqlite3_busy_timeout(db, 10'000);
    EXPECT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK);
    sqlite3_close(db);
  }
  // A correction and a retraction.
  void Live() {
    Open();
    ASSERT_TRUE(Put(MakeKeyframe(1, {{0, 1, 2}})));
    NewPose pose;
    pose.key = {{"bus", "day"}, 1};
    pose.pose = PoseAt(1'000);
    pose.footprint = {{0, 1, 2}};
    ASSERT_TRUE(Update({pose}));
    ASSERT_TRUE(Await<SessionChangeResult>([&](auto done) {
      store_->ChangeSession({{"bus", "day"}, SessionAction::kRetract, "tester", "why not"},
                            std::move(done));
    }));
  }
};

TEST_F(DamagedEventsTest, AnEventThatIsDamagedIsNoticedAndRepaired) {
  for (const char* const damage : {"author = 'mallory'", "kind = 77", "detail = ''", "time_ms = 3",
                                   "revision = revision + 1", "checksum = checksum + 1"}) {
    SCOPED_TRACE(damage);
    store_.reset();
    std::filesystem::remove_all(options_.directory);
    Live();
    ASSERT_TRUE(store_->CheckCounters().ok());
    const std::size_t count = store_->ListEvents(0, 100)->size();
    Spoil("UPDATE events SET " + std::string(damage) + " WHERE id = 2");
    EXPECT_THAT(store_->CheckCounters().message(), HasSubstr("event 2 is damaged"));
    EXPECT_GE(Repair(), 1U);
    EXPECT_TRUE(store_->CheckCounters().ok()) << store_->CheckCounters().message();
    const auto events = store_->ListEvents(0, 100);
    ASSERT_TRUE(events) << events.error().message();
    EXPECT_GE(events->size(), count);
    EXPECT_EQ((*events)[1].id, 2U);
    EXPECT_THAT((*events)[1].detail, HasSubstr("is not known"));
  }
}

TEST_F(DamagedEventsTest, OnlyTheDamagedOneIsNotTold) {
  Live();
  Spoil("UPDATE events SET author = 'mallory' WHERE id = 1");
  const auto events = store_->ListEvents(0, 50);
  ASSERT_TRUE(events) << events.error().message();
  ASSERT_EQ(events->size(), 2U);
  EXPECT_TRUE(events->front().is_damaged);
  EXPECT_EQ(events->front().id, 1U);
  EXPECT_EQ(events->front().author, "");
  EXPECT_FALSE(events->back().is_damaged);
  EXPECT_EQ(events->back().id, 2U);
}

// Numbers begin with 1.
TEST_F(DamagedEventsTest, ANumberThatNoneHasIsToldAsDamaged) {
  for (const char* const damage : {"id = 0", "id = -5", "id = -9223372036854775807"}) {
    SCOPED_TRACE(damage);
    store_.reset();
    std::filesystem::remove_all(options_.directory);
    Live();
    Spoil("UPDATE events SET " + std::string(damage) + " WHERE id = 1");
    for (const std::uint32_t limit : {1U, 50U}) {
      std::vector<Event> told;
      for (std::uint64_t after = 0;;) {
        const auto page = store_->ListEvents(after, limit).value();
        if (page.empty()) {
          break;
        }
        ASSERT_GT(page.front().id, after) << "it comes to an end";
        told.insert(told.end(), page.begin(), page.end());
        after = page.back().id;
      }
      ASSERT_EQ(told.size(), 2U);
      EXPECT_EQ(told.front().id, 1U);
      EXPECT_TRUE(told.front().is_damaged);
      EXPECT_FALSE(told.back().is_damaged);
    }
    EXPECT_GE(Repair(), 1U);
    EXPECT_TRUE(store_->CheckCounters().ok()) << store_->CheckCounters().message();
    const auto events = store_->ListEvents(0, 50).value();
    ASSERT_GE(events.size(), 2U);
    EXPECT_EQ(events[0].id, 1U);
    EXPECT_FALSE(events[0].is_damaged);
    EXPECT_EQ(events[1].kind, EventKind::kRetract);
  }
}

TEST_F(DamagedEventsTest, ANumberWithATurnedBitComesBackWithAllThatStandsThere) {
  for (const char* const damage : {"0", "3", "1 + (1 << 40)", "1 + (1 << 63)"}) {
    SCOPED_TRACE(damage);
    store_.reset();
    std::filesystem::remove_all(options_.directory);
    Live();
    const Event was = store_->ListEvents(0, 1)->front();
    Spoil("UPDATE events SET id = " + std::string(damage) + " WHERE id = 1");
    EXPECT_GE(Repair(), 1U);
    EXPECT_TRUE(store_->CheckCounters().ok()) << store_->CheckCounters().message();
    const Event is = store_->ListEvents(0, 1)->front();
    EXPECT_EQ(is.id, 1U);
    EXPECT_EQ(is.kind, was.kind);
    EXPECT_EQ(is.subject, was.subject);
    EXPECT_EQ(is.revision, was.revision);
  }
}

// Where one is missing: the whole ones are told under their own.
TEST_F(DamagedEventsTest, OneWithoutANumberHidesNoOther) {
  Live();
  Spoil("UPDATE events SET id = -7 WHERE id = 2");
  const auto first = store_->ListEvents(0, 1).value();
  ASSERT_EQ(first.size(), 1U);
  EXPECT_FALSE(first[0].is_damaged);
  const auto events = store_->ListEvents(0, 50).value();
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0].id, 1U);
  EXPECT_FALSE(events[0].is_damaged);
  EXPECT_EQ(events[1].id, 2U);
  EXPECT_TRUE(events[1].is_damaged);
  EXPECT_GE(Repair(), 1U);
  EXPECT_EQ(store_->ListEvents(0, 50)->at(1).id, 2U);
}

// Such as a page that is read twice would make.
TEST_F(DamagedEventsTest, OneTooManyGoes) {
  Live();
  Spoil(
      "INSERT INTO events SELECT 77, revision, time_ms, kind, author, 'x', detail, checksum "
      "FROM events WHERE id = 1");
  EXPECT_GE(Repair(), 1U);
  EXPECT_TRUE(store_->CheckCounters().ok()) << store_->CheckCounters().message();
  const auto events = store_->ListEvents(0, 50).value();
  for (std::size_t i = 0; i < events.size(); ++i) {
    EXPECT_EQ(events[i].id, i + 1);
  }
}

TEST_F(DamagedEventsTest, SoIsABatchOfCorrections) {
  Live();
  Spoil("UPDATE pose_batches SET author = 'mallory', revision = 77");
  EXPECT_THAT(store_->CheckCounters().message(), HasSubstr("pose batch 1 is damaged"));
  EXPECT_GE(Repair(), 1U);
  EXPECT_TRUE(store_->CheckCounters().ok()) << store_->CheckCounters().message();
  EXPECT_EQ(Repair(), 0U);
}

}  // namespace
}  // namespace atlas
