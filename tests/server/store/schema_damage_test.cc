// A schema whose text is damaged: no file is read by it, and a daemon that starts puts it back.
#include <algorithm>
#include <fstream>
#include <iterator>
#include <tuple>

#include <gmock/gmock.h>

#include "server/store/sqlite/schema/schema.h"
#include "server/store/sqlite/store_snapshot.h"
#include "tests/server/store/schema_fixture.h"
#include "tests/server/store/turned_bits.h"

namespace atlas {
namespace {

using ::testing::HasSubstr;

struct Damage {
  const char* how;
  const char* of;    // what the message names
  const char* what;  // and what it says of it
};

// Columns, keys, constraints, tables, indexes, entries; those at the end SQLite cannot read.
constexpr Damage kDamages[] = {
    {"sql = replace(sql, 'id INTEGER PRIMARY', 'id INUEGER PRIMARY') WHERE name = 'session_states'",
     "table session_states", "inueger instead of integer"},
    {"sql = replace(sql, 'epoch INTEGER', 'fpoch INTEGER') WHERE name = 'meta'", "table meta",
     "fpoch instead of epoch"},
    {"sql = replace(sql, 'author TEXT', 'author TEYT') WHERE name = 'pose_history'",
     "table pose_history", "teyt instead of text"},
    {"sql = replace(sql, 'reason TEXT NOT NULL', 'reason TEXT') WHERE name = 'session_states'",
     "table session_states", ", instead of not"},
    {"sql = replace(sql, 'attempts INTEGER NOT NULL DEFAULT 0', 'attempts INTEGER NOT NULL "
     "DEFAULT 4') WHERE name = 'dirty_tiles'",
     "table dirty_tiles", "4 instead of 0"},
    {"sql = replace(sql, 'id = 1', 'id = 3') WHERE name = 'meta'", "table meta", "3 instead of 1"},
    {"sql = replace(sql, 'vehicle TEXT', 'vehicle TEXT COLLATE NOCASE') WHERE name = 'sessions'",
     "table sessions", "collate instead of not"},
    {"sql = replace(sql, 'x_um INTEGER NOT NULL, y_um INTEGER NOT NULL', 'y_um INTEGER NOT NULL, "
     "x_um INTEGER NOT NULL') WHERE name = 'poses'",
     "table poses", "y_um instead of x_um"},
    {"sql = sql || ' STRICT' WHERE name = 'starts'", "table starts", "strict instead of nothing"},
    {"sql = replace(sql, ' WITHOUT ROWID', '') WHERE name = 'tombstones'", "table tombstones",
     "nothing instead of without"},
    {"sql = replace(sql, 'state = 2', 'state = 3') WHERE name = 'quarantined_sessions'",
     "index quarantined_sessions", "3 instead of 2"},
    {"sql = replace(sql, '(since)', '(generation)') WHERE name = 'dirty_since'",
     "index dirty_since", "generation instead of since"},
    {"sql = replace(sql, 'INDEX', 'UNIQUE INDEX') WHERE name = 'tiles_of_keyframe'",
     "index tiles_of_keyframe", "unique instead of index"},
    {"sql = replace(sql, 'tile_key, revision', 'tile_key DESC, revision') WHERE name = "
     "'changes_of_tile'",
     "index changes_of_tile", "desc instead of ,"},
    {"sql = replace(sql, 'dirty_since', 'dirty_sinbe') WHERE name = 'dirty_since'",
     "index dirty_since", "dirty_sinbe instead of dirty_since"},
    {"sql = replace(sql, 'events', 'eventr') WHERE name = 'events'", "table events",
     "eventr instead of events"},
    {"name = 'eventr' WHERE name = 'events'", "table events", "eventr instead of events"},
    {"name = 'dirty_sinbe' WHERE name = 'dirty_since'", "index dirty_since",
     "dirty_sinbe instead of dirty_since"},
    {"tbl_name = 'tilds' WHERE name = 'tiles'", "table tiles", "tilds instead of tiles"},
    {"type = 'tablf' WHERE name = 'tiles'", "table tiles", "tablf instead of table"},
    {"name = CAST(name AS BLOB) WHERE name = 'poses'", "table poses", "another type"},
    {"name = 'sqlite_autoindex_keyframes_3' WHERE name = 'sqlite_autoindex_keyframes_1'",
     "index sqlite_autoindex_keyframes_1", "sqlite_autoindex_keyframes_3 instead of"},
    {"sql = replace(sql, 'PRIMARY KEY', 'PRIMARY KEX') WHERE name = 'keyframes'", "table keyframes",
     "kex instead of key"},
    {"sql = replace(sql, 'CREATE', 'CR' || char(5) || 'ATE') WHERE name = 'tiles'", "table tiles",
     "cr instead of create"},
    {"sql = NULL WHERE name = 'counters'", "table counters", "nothing instead of create"},
    {"sql = replace(sql, 'INDEX', 'INDFX') WHERE name = 'tile_summaries'", "index tile_summaries",
     "indfx instead of index"},
};

class SchemaDamageTest : public SchemaTest {
 protected:
  SchemaDamageTest() {
    options_.on_repair = [this](const std::string& what) {
      told_ += what;
    };
  }

  void ExpectNamed(const Status& status, const Damage& damage) {
    EXPECT_EQ(status.code(), StatusCode::kInvalidData);
    EXPECT_THAT(status.message(), HasSubstr(damage.of));
    EXPECT_THAT(status.message(), HasSubstr(damage.what));
    EXPECT_THAT(status.message(), HasSubstr("a start of atlasd on it puts that right"));
  }
  std::string BytesOf(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  // A start that ends with an error, and what it said.
  std::string Refusal() {
    const std::string before = BytesOf(Database());
    const auto store = OpenSqliteStore(options_);
    EXPECT_FALSE(store);
    EXPECT_EQ(BytesOf(Database()), before) << "nothing is changed";
    return store ? "" : store.error().message();
  }

  std::string told_;
  int refused_ = 0;
};

TEST_F(SchemaDamageTest, NoFileIsReadByIt) {
  Fill(4);
  store_.reset();
  const std::string intact = BytesOf(Database());
  for (const Damage& damage : kDamages) {
    SCOPED_TRACE(damage.how);
    std::ofstream(backup(), std::ios::binary) << intact;
    Spoil(backup(), damage.how);
    const auto snapshot = StoreSnapshot::Open(backup());
    ASSERT_FALSE(snapshot);
    ExpectNamed(snapshot.error(), damage);
    const auto taken = Restore();
    ASSERT_FALSE(taken);
    ExpectNamed(taken.error(), damage);
    EXPECT_FALSE(std::filesystem::exists(restored().parent_path())) << "nothing is written";
  }
}

TEST_F(SchemaDamageTest, AStartPutsItBack) {
  Fill(4);
  store_.reset();
  const std::string intact = BytesOf(Database());
  const auto texts = Texts();
  for (const Damage& damage : kDamages) {
    SCOPED_TRACE(damage.how);
    std::filesystem::remove_all(options_.directory);
    std::filesystem::create_directories(options_.directory);
    std::ofstream(Database(), std::ios::binary) << intact;
    Spoil(Database(), damage.how);
    ASSERT_NE(Texts(), texts);
    told_.clear();
    Open();
    ASSERT_TRUE(store_);
    EXPECT_THAT(told_, HasSubstr(damage.of));
    ASSERT_EQ(Repairs().size(), 1U);
    EXPECT_EQ(Repairs()[0].subject, "schema");
    EXPECT_THAT(Repairs()[0].detail, HasSubstr(damage.what));
    EXPECT_TRUE(CheckAll().ok()) << CheckAll().message();
    ASSERT_TRUE(Put(MakeKeyframe(99, {{0, 0, 0}})));
    Tamper("PRAGMA integrity_check");
    EXPECT_EQ(Texts(), texts);
    told_.clear();
    Open();
    EXPECT_EQ(told_, "");
    EXPECT_EQ(store_->ReadCounts()->keyframes, 5U);
    store_.reset();
  }
}

// A backup is refused, and not lost: a daemon that opens it once leaves one that is taken.
TEST_F(SchemaDamageTest, ABackupThatAStartPutRightIsRestored) {
  Fill(4);
  ASSERT_TRUE(WriteBackup());
  store_.reset();
  const auto rows = RowsOf(backup());
  Spoil(backup(), kDamages[0].how);
  ASSERT_FALSE(Restore());
  options_.directory = directory_ / "aside";
  std::filesystem::create_directories(options_.directory);
  std::filesystem::rename(backup(), Database());
  Open();
  store_.reset();
  std::filesystem::rename(Database(), backup());
  const auto taken = Restore();
  ASSERT_TRUE(taken) << taken.error().message();
  EXPECT_EQ(RowsOf(restored()), rows);
}

TEST_F(SchemaDamageTest, SeveralArePutBackAtOnce) {
  Fill(4);
  store_.reset();
  const auto texts = Texts();
  const auto rows = RowsOf(Database());
  Spoil(Database(), "sql = replace(sql, 'INTEGER', 'INUEGER')");
  Open();
  EXPECT_TRUE(CheckAll().ok()) << CheckAll().message();
  ASSERT_EQ(Repairs().size(), 1U);
  EXPECT_THAT(Repairs()[0].detail, HasSubstr("table events"));
  EXPECT_THAT(Repairs()[0].detail, HasSubstr("table tiles"));
  store_.reset();
  EXPECT_EQ(Texts(), texts);
  EXPECT_EQ(RowsOf(Database()), rows);
}

// Capitals and the layout are nothing that SQLite reads, nor are the quotes that it sets itself.
TEST_F(SchemaDamageTest, WhatSaysTheSameIsLeftAsItIs) {
  Fill(4);
  store_.reset();
  Spoil(Database(),
        "sql = replace(replace(replace(sql, 'INTEGER', 'Integer'), char(10), ' '), 'TABLE poses', "
        "'TABLE \"poses\"')");
  const auto texts = Texts();
  CopyToBackup();
  EXPECT_TRUE(StoreSnapshot::Open(backup()));
  EXPECT_TRUE(Restore());
  Open();
  EXPECT_EQ(told_, "");
  EXPECT_TRUE(CheckAll().ok()) << CheckAll().message();
  store_.reset();
  EXPECT_EQ(Texts(), texts);
}

// An index of other rows is made anew of those of its table.
TEST_F(SchemaDamageTest, AnotherIndexOfTheNameIsMadeAnew) {
  Fill(4);
  Tamper("DROP INDEX dirty_since; CREATE INDEX dirty_since ON dirty_tiles (shard) WHERE key > 0");
  Open();
  EXPECT_TRUE(CheckAll().ok()) << CheckAll().message();
  EXPECT_THAT(told_, HasSubstr("index dirty_since"));
}

// While a daemon runs, a verification names it, nothing is written by it, and the next start puts
// it back.
TEST_F(SchemaDamageTest, UnderARunningStoreItIsNamedAndNothingIsRepairedByIt) {
  Fill(4);
  Spoil(Database(), kDamages[0].how);
  ExpectNamed(store_->CheckCounters(), kDamages[0]);
  ExpectNamed(store_->CheckIndexes([] { return Status(); }), kDamages[0]);
  for (const TableRepair what : {TableRepair::kRows, TableRepair::kIndexes, TableRepair::kSums}) {
    const auto repaired = Await<std::uint32_t>(
        [&](auto done) { store_->RepairTables(what, "tester", std::move(done)); });
    ASSERT_FALSE(repaired);
    ExpectNamed(repaired.error(), kDamages[0]);
  }
  const auto copied = WriteBackup();
  ASSERT_FALSE(copied);
  ExpectNamed(copied.error(), kDamages[0]);
  Open();
  EXPECT_TRUE(CheckAll().ok()) << CheckAll().message();
  EXPECT_TRUE(WriteBackup());
}

TEST_F(SchemaDamageTest, WithOtherDamageNothingIsChanged) {
  Fill(4);
  Tamper("DELETE FROM poses WHERE keyframe_id = 2");
  Spoil(Database(), kDamages[0].how);
  const std::string refusal = Refusal();
  EXPECT_THAT(refusal, HasSubstr("table session_states"));
  EXPECT_THAT(refusal, HasSubstr("table poses has 3 rows"));
  EXPECT_THAT(refusal, HasSubstr("nothing was changed; restore a backup"));
}

// Two tables on the same pages: what one of them drops, the other loses.
TEST_F(SchemaDamageTest, TablesThatBeginOnOnePageAreRefused) {
  Fill(4);
  store_.reset();
  Spoil(Database(),
        "rootpage = (SELECT rootpage FROM sqlite_schema WHERE name = 'keyframes') "
        "WHERE name = 'dirty_tiles'");
  CopyToBackup();
  EXPECT_THAT(Refusal(), HasSubstr("table keyframes and table dirty_tiles begin on one page"));
  EXPECT_EQ(StoreSnapshot::Open(backup()).error().code(), StatusCode::kInvalidData);
}

// A page of another table, but none that it begins on: what a start finds there is no mark, no
// counter and no session, and what it would write instead is not to be written there.
TEST_F(SchemaDamageTest, WhatBeginsInTheMiddleOfAnotherTableIsNotPutRight) {
  Fill(400, 100);
  store_.reset();
  const std::string intact = BytesOf(Database());
  for (const char* const table : {"dirty_tiles", "counters", "sessions"}) {
    for (const char* const other : {"keyframes", "poses", "pose_history", "starts", "events"}) {
      SCOPED_TRACE(std::string(table) + " in " + other);
      std::ofstream(Database(), std::ios::binary) << intact;
      const std::string page = std::string("(SELECT max(pageno) FROM dbstat WHERE name = '") +
                               other + "' AND pagetype = 'leaf' AND path <> '/')";
      if (testing::AskDatabase(Database(), "SELECT coalesce(" + page + ", 0)") == 0) {
        continue;  // all of it is on its first page
      }
      Spoil(Database(), "rootpage = " + page + " WHERE name = '" + table + "'");
      EXPECT_THAT(Refusal(), HasSubstr("restore a backup"));
      ++refused_;
    }
  }
  EXPECT_GE(refused_, 9);
}

TEST_F(SchemaDamageTest, WhatMeddlesWithTablesOfAnAtlasIsRefusedUntilItIsDropped) {
  Fill(4);
  store_.reset();
  for (const auto& [type, name, definition] :
       {std::tuple{"TRIGGER", "extra", " AFTER INSERT ON tiles BEGIN DELETE FROM poses; END"},
        std::tuple{"VIEW", "extra", " AS SELECT 1"},
        std::tuple{"INDEX", "extra", " ON poses (batch)"}}) {
    SCOPED_TRACE(type);
    const std::string what = std::string(type) + " " + name;
    Tamper("CREATE " + what + definition);
    CopyToBackup();
    EXPECT_THAT(Refusal(), HasSubstr(" extra, and no atlas does"));
    EXPECT_EQ(StoreSnapshot::Open(backup()).error().code(), StatusCode::kInvalidData);
    Tamper("DROP " + what);
    EXPECT_EQ(OpenCode(), StatusCode::kOk);
  }
  Tamper("CREATE TABLE notes (text); CREATE INDEX of_notes ON notes (text)");
  EXPECT_EQ(OpenCode(), StatusCode::kOk) << "a table of somebody else";
  Tamper(
      "CREATE VIRTUAL TABLE words USING fts5 (text); CREATE VIRTUAL TABLE more USING fts5 (text)");
  EXPECT_EQ(OpenCode(), StatusCode::kOk) << "two that have no page of their own";
}

// A file of the version before is upgraded behind it.
TEST_F(SchemaDamageTest, OfTheVersionBeforeItIsPutBackToo) {
  Fill(4);
  store_.reset();
  const auto texts = Texts();
  Tamper("DROP INDEX quarantined_sessions; PRAGMA user_version = " +
         std::to_string(kFirstReadableVersion));
  Spoil(Database(), kDamages[0].how);
  Open();
  EXPECT_TRUE(CheckAll().ok()) << CheckAll().message();
  EXPECT_EQ(Repairs().size(), 1U);
  EXPECT_EQ(store_->ListEvents(0, 100)->back().kind, EventKind::kUpgraded);
}

}  // namespace
}  // namespace atlas
