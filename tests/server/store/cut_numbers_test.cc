// Numbers beyond what a column is read as, or that do not follow from their key as they should:
// rows with them are damaged, whatever the rest of their bits is, and come back where an index
// tells what they were.
#include "tests/server/store/backup_fixture.h"

namespace atlas {
namespace {

class CutNumbersTest : public BackupTest {
 protected:
  // A row of each table. The second session is retracted, a keyframe of it is listed as damaged.
  void Live() {
    Fill(3);
    NewKeyframe night = Keyframe(1);
    night.key.session.session = "night";
    ASSERT_TRUE(Put(night));
    ASSERT_TRUE(Await<SessionChangeResult>([&](auto done) {
      store_->ChangeSession({{"bus", "night"}, SessionAction::kRetract, "tester", "why not"},
                            std::move(done));
    }));
    ASSERT_TRUE(Await<CompactionResult>([&](auto done) {
      store_->Compact({Dirty().revision, 5'000, {3}, "tester"}, std::move(done));
    }));
    ASSERT_EQ(Findings(), "");
    ASSERT_FALSE(Claim().claims.empty()) << "there are marks";
  }
  // As a verification asks, without the blobs.
  std::string Findings() {
    std::string text;
    const auto add = [&text](const Status& status) {
      text += status.ok() ? "" : status.message() + "; ";
    };
    const auto sessions = store_->ListSessions({}, 100).value();
    for (const SessionRecord& session : sessions) {
      add(store_->CheckSession(session.key));
    }
    for (const Status& status : {store_->CheckCounters(), store_->CheckCompactions()}) {
      add(status);
    }
    const auto ids = store_->ListKeyframeIds(0, 100).value();
    for (const std::int64_t id : ids) {
      const auto keyframe = store_->ReadKeyframe(id);
      add(keyframe ? Status() : keyframe.error());
    }
    const auto tiles = store_->ListTiles(-1, 100).value();
    for (const TileSummary& summary : tiles) {
      const auto tile = store_->ReadTile(summary.id);
      add(tile ? Status() : tile.error());
    }
    return text;
  }
  void Spoil(const std::string& what) {
    const std::string sql = "UPDATE " + what;
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(Database().c_str(), &db), SQLITE_OK);
    sqlite3_busy_timeout(db, 10'000);
    EXPECT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sql;
    EXPECT_GT(sqlite3_changes(db), 0) << sql;
    sqlite3_close(db);
  }
};

TEST_F(CutNumbersTest, AreDamageThatVerificationAndRestoreName) {
  Live();
  store_.reset();
  const std::filesystem::path intact = directory_ / "intact";
  std::filesystem::copy_file(Database(), intact);
  const auto put = [](const std::filesystem::path& from, const std::filesystem::path& to) {
    std::filesystem::copy_file(from, to, std::filesystem::copy_options::overwrite_existing);
  };
  for (const char* const damage :
       {"keyframes SET sequence = sequence + 4294967296 WHERE id = 1",
        "keyframes SET session_id = session_id + 0.5 WHERE id = 1",
        "keyframes SET cell_size_um = cell_size_um + 4294967296",
        "keyframes SET radius_cells = radius_cells - 4294967296",
        "keyframes SET level_qx = level_qx + (1 << 62)",
        "keyframes SET blob_bytes = blob_bytes + 4294967296",
        "poses SET qx = qx + 4294967296",
        "poses SET qw = qw - 4294967296",
        "pose_history SET qy = qy + 4294967296",
        "pose_history SET qz = qz + (1 << 62)",
        "sessions SET last_sequence = last_sequence + 4294967296",
        "sessions SET state = state + 256",
        "session_states SET state = state + 256",
        "session_states SET state = state - 256 WHERE session_id = 2",
        "session_states SET reason = CAST(reason AS BLOB)",
        "tombstones SET sequence = sequence + 4294967296",
        "tombstones SET blob_bytes = blob_bytes + 4294967296",
        "tiles SET cells = cells + 4294967296",
        "tiles SET multilayer_cells = multilayer_cells + 4294967296",
        "tiles SET blob_bytes = blob_bytes + 4294967296",
        "tiles SET shard = shard + 1",
        "keyframe_tiles SET is_current = 2 WHERE is_current = 1",
        "keyframe_tiles SET is_current = 4294967297 WHERE is_current = 1",
        "events SET kind = kind + 256",
        "events SET author = CAST(author AS BLOB) WHERE id = 1",
        "pose_batches SET author = CAST(author AS BLOB)",
        "compactions SET author = CAST(author AS BLOB)",
        "starts SET id = CAST(id AS TEXT)"}) {
    SCOPED_TRACE(damage);
    put(intact, Database());
    Spoil(damage);
    put(Database(), backup());
    const auto taken = Restore();
    ASSERT_FALSE(taken);
    EXPECT_EQ(taken.error().code(), StatusCode::kInvalidData) << taken.error().message();

    put(intact, Database());
    Open();
    Spoil(damage);
    EXPECT_NE(Findings(), "") << "while it is served";
    store_.reset();
  }
}

// Marks are looked at when the daemon starts.
TEST_F(CutNumbersTest, MarksThatDoNotFollowFromTheirKeyAreSetAgain) {
  Live();
  for (const char* const damage : {"shard = shard + 1", "level = level + 1"}) {
    SCOPED_TRACE(damage);
    store_.reset();
    Spoil(std::string("dirty_tiles SET ") + damage);
    std::filesystem::copy_file(Database(), backup(),
                               std::filesystem::copy_options::overwrite_existing);
    const auto taken = Restore();
    ASSERT_FALSE(taken);
    EXPECT_EQ(taken.error().code(), StatusCode::kInvalidData) << taken.error().message();
    Open();
    const auto events = store_->ListEvents(0, 1'000).value();
    EXPECT_EQ(events.back().kind, EventKind::kMarksRestored);
  }
}

// One of them may have the number of a keyframe that is whole.
TEST_F(CutNumbersTest, ATombstoneWithOneGoesAndNoOther) {
  Live();
  ASSERT_TRUE(Await<CompactionResult>([&](auto done) {
    store_->Compact({Dirty().revision, 5'000, {2}, "tester"}, std::move(done));
  }));
  Tamper("UPDATE tombstones SET sequence = 2 + 4294967296 WHERE sequence = 3");
  Open();
  for (const TableRepair what : {TableRepair::kRows, TableRepair::kSums}) {
    const auto repaired = Await<std::uint32_t>(
        [&](auto done) { store_->RepairTables(what, "tester", std::move(done)); });
    ASSERT_TRUE(repaired) << repaired.error().message();
  }
  EXPECT_EQ(Findings(), "");
  EXPECT_TRUE(Put(Keyframe(2))->is_duplicate);
  EXPECT_FALSE(Put(Keyframe(3))->is_duplicate);
}

}  // namespace
}  // namespace atlas
