// Which revisions are lost, and whether something was purged, while the events that tell it are
// damaged or gone: nobody is told anything else for it.
#include "tests/server/store/backup_fixture.h"
#include "tests/server/store/purge_fixture.h"

namespace atlas {
namespace {

std::uint32_t RepairTables(AtlasStore& store) {
  std::uint32_t repaired = 0;
  for (const TableRepair what : {TableRepair::kRows, TableRepair::kSums}) {
    const auto result = Await<std::uint32_t>(
        [&](auto done) { store.RepairTables(what, "tester", std::move(done)); });
    EXPECT_TRUE(result) << result.error().message();
    repaired += result.value_or(0U);
  }
  return repaired;
}

class DamagedPastTest : public BackupTest {
 protected:
  // A restore, with the revisions before it, that are lost, and behind it.
  void Live() {
    Fill(3);
    const auto facts = WriteBackup();
    ASSERT_TRUE(facts) << facts.error().message();
    before_ = facts->revision;
    ASSERT_TRUE(Put(Keyframe(4)));
    ASSERT_TRUE(Put(Keyframe(5)));
    lost_ = store_->revision();
    ASSERT_TRUE(Restore());
    OpenRestored();
    ASSERT_TRUE(Put(Keyframe(4)));
    ASSERT_TRUE(Await<SessionChangeResult>([&](auto done) {
      store_->ChangeSession({{"bus", "day"}, SessionAction::kRetract, "tester", ""},
                            std::move(done));
    }));
    begin_ = before_ + 1 + kRevisionsLeftOut;
    now_ = store_->revision();
  }
  void ExpectLost() {
    for (const std::uint64_t revision : {before_ + 1, lost_, begin_ - 1}) {
      EXPECT_EQ(store_->CheckRevision(revision).code(), StatusCode::kNotFound) << revision;
    }
    EXPECT_TRUE(store_->CheckRevision(now_).ok()) << store_->CheckRevision(now_).message();
  }

  std::uint64_t before_ = 0;
  std::uint64_t lost_ = 0;
  std::uint64_t begin_ = 0;
  std::uint64_t now_ = 0;
};

TEST_F(DamagedPastTest, LostRevisionsStayLost) {
  for (const char* const damage :
       {"UPDATE events SET author = 'x' WHERE kind = 13",
        "UPDATE events SET kind = 1 WHERE kind = 13",
        "UPDATE events SET revision = revision - 4294967296 WHERE kind = 13",
        "UPDATE events SET revision = revision + (1 << 50) WHERE kind = 13",
        "UPDATE events SET id = id + 16 WHERE kind = 13",
        "UPDATE events SET id = -7 WHERE kind = 13", "UPDATE events SET checksum = 0",
        "DELETE FROM events WHERE kind = 13", "DELETE FROM events"}) {
    SCOPED_TRACE(damage);
    store_.reset();
    for (const char* const name : {"data", "backups", "restored"}) {
      std::filesystem::remove_all(directory_ / name);
    }
    std::filesystem::create_directories(folder());
    options_.directory = directory_ / "data";
    Live();
    ExpectLost();
    Tamper(damage);
    Open();
    ExpectLost();
    EXPECT_TRUE(store_->CheckRevision(before_).ok()) << "the list of starts tells which were given";
    EXPECT_GE(RepairTables(*store_), 1U);
    const Status counted = store_->CheckCounters();
    EXPECT_TRUE(counted.ok()) << counted.message();
    ExpectLost();
    Open();
    ExpectLost();
    Tamper("DELETE FROM starts");  // as there were a hundred since
    Open();
    ExpectLost();
  }
}

// Of the first of two nothing is known, of the second all.
TEST_F(DamagedPastTest, EachLineHasItsOwn) {
  Live();
  std::filesystem::remove(backup());
  ASSERT_TRUE(WriteBackup());
  ASSERT_TRUE(Put(Keyframe(7)));
  const std::uint64_t lost = store_->revision();
  store_.reset();
  const auto again = Restore(true);
  ASSERT_TRUE(again) << again.error().message();
  OpenRestored();
  ASSERT_EQ(store_->identity().lost.size(), 2U);
  const LostRevisions second = store_->identity().lost.back();
  EXPECT_EQ(second, (LostRevisions{now_, now_ + 1 + kRevisionsLeftOut}));
  Tamper(
      "DELETE FROM starts; UPDATE events SET kind = 77 WHERE kind = 13 AND id = "
      "(SELECT min(id) FROM events WHERE kind = 13)");
  Open();
  ExpectLost();
  EXPECT_EQ(store_->CheckRevision(lost).code(), StatusCode::kNotFound);
  ASSERT_EQ(store_->identity().lost.size(), 2U);
  EXPECT_EQ(store_->identity().lost.back(), second);
}

class DamagedPurgeTest : public PurgeTest {};

TEST_F(DamagedPurgeTest, TheNextStartEmptiesTheLogWhateverBecameOfTheEvent) {
  for (const char* const damage :
       {"UPDATE events SET author = 'x'", "UPDATE events SET kind = 1", "DELETE FROM events",
        "UPDATE sessions SET state = 1; DELETE FROM session_states",
        "UPDATE events SET kind = 1; UPDATE sessions SET state = 1; DELETE FROM session_states",
        "DELETE FROM events; UPDATE sessions SET state = 1 WHERE state = 5"}) {
    SCOPED_TRACE(damage);
    store_.reset();
    std::filesystem::remove_all(options_.directory);
    Fill();
    Reader reader(Database());
    ASSERT_TRUE(Change(SessionAction::kPurge).has_value());
    store_.reset();  // the reader keeps the log where it is
    reader.Run("COMMIT; PRAGMA wal_autocheckpoint = 0");
    reader.Run(damage);
    EXPECT_GT(InTheFiles(Secret()), 1'000U);
    Open();
    EXPECT_TRUE(IsSoonGone(Secret()));
  }
}

}  // namespace
}  // namespace atlas
