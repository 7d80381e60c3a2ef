// An atlas that version 1 of the schema wrote (tests/golden/store_v1.sql): two sessions of two
// keyframes each, two of which were moved far away and one of those back.
#include <fstream>
#include <iterator>
#include <set>

#include <sqlite3.h>

#include "tests/server/store/store_fixture.h"

namespace atlas {
namespace {

class MigrationTest : public StoreTest {
 protected:
  MigrationTest() { options_.new_profile.reset(); }
  void Run(const std::string& sql) {
    store_.reset();
    std::filesystem::create_directories(options_.directory);
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(Database().c_str(), &db), SQLITE_OK);
    char* message = nullptr;
    EXPECT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, &message), SQLITE_OK) << message;
    sqlite3_close(db);
  }
  void WriteVersion1() {
    std::ifstream in(std::string(ATLAS_GOLDEN_DIR) + "/store_v1.sql");
    Run({std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()});
  }
  std::int64_t Ask(const std::string& sql) {
    store_.reset();
    sqlite3* db = nullptr;
    EXPECT_EQ(sqlite3_open(Database().c_str(), &db), SQLITE_OK);
    sqlite3_stmt* statement = nullptr;
    EXPECT_EQ(sqlite3_prepare_v2(db, sql.c_str(), -1, &statement, nullptr), SQLITE_OK);
    EXPECT_EQ(sqlite3_step(statement), SQLITE_ROW);
    const std::int64_t value = sqlite3_column_int64(statement, 0);
    sqlite3_finalize(statement);
    sqlite3_close(db);
    return value;
  }
  std::set<KeyframeKey> KeysAt(const TileId& id, std::uint64_t revision) {
    const auto sources = store_->GatherTileAt(id, revision);
    EXPECT_TRUE(sources.has_value()) << sources.error().message();
    std::set<KeyframeKey> keys;
    for (const KeyframeRecord& record : sources->keyframes) {
      keys.insert(record.key);
    }
    return keys;
  }
};

TEST_F(MigrationTest, AVersion1AtlasOpensWithItsHistory) {
  WriteVersion1();
  Open();
  EXPECT_EQ(store_->ReadCounts()->revision, 109u);
  EXPECT_EQ(store_->ReadCounts()->tiles, 20u);
  EXPECT_EQ(Dirty().dirty_tiles, 0u);
  const KeyframeKey day0{{"bus", "day"}, 0};
  const KeyframeKey day1{{"bus", "day"}, 1};
  const KeyframeKey night0{{"bus", "night"}, 0};
  const TileId middle{0, 0, 0};
  EXPECT_TRUE(KeysAt(middle, 0).empty());
  EXPECT_EQ(KeysAt(middle, 1), std::set{day0});
  EXPECT_EQ(KeysAt(middle, 27), (std::set{day0, day1, night0}));
  const TileId far{0, 2, -2};  // where day/1 was from revision 44 to 95
  EXPECT_EQ(KeysAt(far, 44), std::set{day1});
  EXPECT_TRUE(store_->GatherTile(far)->keyframes.empty());
  const auto sessions = store_->ListSessions().value();
  for (const SessionRecord& session : sessions) {
    EXPECT_TRUE(store_->CheckSession(session.key).ok());
  }
  const auto ids = store_->ListKeyframeIds(0, 100).value();
  for (const std::int64_t id : ids) {
    EXPECT_TRUE(store_->ReadKeyframe(id).has_value());
  }
}

TEST_F(MigrationTest, MigratingHappensOnceAndWritesTheNewVersion) {
  WriteVersion1();
  Open();
  EXPECT_EQ(Ask("PRAGMA user_version"), 2);
  EXPECT_EQ(Ask("SELECT count(*) FROM session_states"), 2);
  EXPECT_EQ(Ask("SELECT sum(revision) FROM session_states"), 1 + 27);
  const std::int64_t rows = Ask("SELECT count(*) FROM footprint_history");
  EXPECT_GT(rows, 0);
  Open();
  EXPECT_EQ(Ask("SELECT count(*) FROM footprint_history"), rows);
  EXPECT_EQ(Ask("SELECT value FROM counters WHERE name = 'history_horizon'"), 0);
}

TEST_F(MigrationTest, AnAtlasThatCannotBeMigratedStaysAsItWas) {
  WriteVersion1();
  Run("CREATE TABLE session_states (x)");
  EXPECT_NE(OpenCode(), StatusCode::kOk);
  EXPECT_EQ(Ask("PRAGMA user_version"), 1);
  EXPECT_EQ(Ask("SELECT count(*) FROM sqlite_master WHERE name = 'footprint_history'"), 0);
  Run("DROP TABLE session_states");
  EXPECT_EQ(OpenCode(), StatusCode::kOk);
}

TEST_F(MigrationTest, DamagedRowsDoNotKeepAnAtlasFromOpening) {
  WriteVersion1();
  Run("UPDATE pose_history SET x_um = 9223372036854775807 WHERE revision = 18;"
      "UPDATE keyframes SET radius_cells = 2000000000 WHERE id = 3");
  Open();
  EXPECT_EQ(store_->ReadCounts()->keyframes, 4u);
  EXPECT_EQ(store_->GatherTileAt({0, 0, 0}, 20).error().code(), StatusCode::kInvalidData);
  EXPECT_EQ(store_->GatherTileAt({0, 0, 0}, 1)->keyframes.size(), 1u);
}

TEST_F(MigrationTest, SessionsOfAMigratedAtlasCanBeRetracted) {
  WriteVersion1();
  Open();
  const auto change = [&](SessionAction action) {
    return Await<SessionChangeResult>([&](auto done) {
             store_->ChangeSession({{"bus", "night"}, action, "tester", ""}, std::move(done));
           })
        .value();
  };
  const auto retracted = change(SessionAction::kRetract);
  EXPECT_TRUE(retracted.is_changed);
  EXPECT_GT(retracted.tiles_marked, 0u);
  EXPECT_EQ(change(SessionAction::kRestore).state, SessionState::kLive);
}

}  // namespace
}  // namespace atlas
