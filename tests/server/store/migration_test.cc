// Atlases of every earlier schema, opened: all that was in them is there, and they go on.
#include <algorithm>
#include <functional>
#include <map>
#include <set>

#include <gmock/gmock.h>

#include "server/store/sqlite/store_snapshot.h"
#include "tests/server/store/as_nobody.h"
#include "tests/server/store/migration_fixture.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class MigrationTest : public EarlierStoreTest {
 protected:
  void Tamper(const std::string& sql) { testing::OpenDatabase(Database()).Execute(sql); }
  std::string Detail() { return store_->ListEvents(0, 1).value().at(0).detail; }
  // Where the keyframes that ever touched a tile stood, by their ids.
  std::map<std::int64_t, std::int64_t> PlacesAt(const TileId& id, std::uint64_t revision) {
    std::map<std::int64_t, std::int64_t> x_um;
    const auto sources = store_->GatherTileAt(id, revision);
    EXPECT_TRUE(sources.has_value()) << sources.error().message();
    for (const KeyframeRecord& record : sources->keyframes) {
      x_um[record.id] = record.pose.x_um;
    }
    return x_um;
  }
};

INSTANTIATE_TEST_SUITE_P(Versions,
                         MigrationTest,
                         ::testing::ValuesIn(testing::kEarlierStores),
                         [](const auto& made) { return std::string(made.param.name); });

TEST_P(MigrationTest, AllThatWasInItIsThere) {
  Make();
  if (GetParam().version < 5) {                          // else that is damage
    Tamper("UPDATE dirty_tiles SET since = since - 1");  // marked twice
  }
  std::map<std::string, std::vector<std::string>> before;
  for (const std::string table :
       {"meta", "keyframes", "poses", "pose_history", "pose_batches", "session_states",
        "compactions", "tombstones", "starts", "tiles"}) {
    if (HasTable(table) && (table != "tiles" || GetParam().version > 1)) {
      before["SELECT * FROM " + table + " ORDER BY 1, 2"];
    }
  }
  before
      ["SELECT id, vehicle, session, state, keyframes, bytes, first_time_ms, last_time_ms, "
       "last_sequence FROM sessions"];
  before["SELECT key, shard, level, generation, since FROM dirty_tiles"];
  for (auto& [sql, rows] : before) {
    rows = Select(sql);
  }
  const std::string is_current = GetParam().version < 3 ? "1" : "is_current";
  const auto footprints = Select("SELECT tile_key, keyframe_id FROM keyframe_tiles WHERE " +
                                 is_current + " ORDER BY 1, 2");
  Open();
  for (const auto& [sql, rows] : before) {
    EXPECT_EQ(Select(sql), rows) << sql;
  }
  EXPECT_EQ(
      Select("SELECT tile_key, keyframe_id FROM keyframe_tiles WHERE is_current ORDER BY 1, 2"),
      footprints);
  EXPECT_EQ(Ask("PRAGMA user_version"), kStoreSchemaVersion);
  Open();
  ExpectSound();
  EXPECT_GT(Dirty().dirty_tiles, 0u);
}

TEST_P(MigrationTest, ItsTablesAreThoseOfANewAtlas) {
  const auto schema = [this] {
    std::set<std::string> objects;
    for (std::string row : Select("SELECT type, name, sql FROM sqlite_master")) {
      row.erase(
          std::remove_if(row.begin(), row.end(), [](char c) { return c == ' ' || c == '\n'; }),
          row.end());
      objects.insert(row);
    }
    return objects;
  };
  options_.new_profile = MapProfile();
  Open();
  const auto expected = schema();
  const auto counters = Select("SELECT id, name FROM counters");
  fs::remove_all(options_.directory);
  Make();
  Open();
  EXPECT_EQ(schema(), expected);
  EXPECT_EQ(Select("SELECT id, name FROM counters"), counters);
  EXPECT_EQ(Select("PRAGMA integrity_check"), std::vector<std::string>{"3:ok|"});
}

TEST_P(MigrationTest, TheUpgradeIsAnEventAndHappensOnce) {
  std::vector<std::int64_t> told;
  options_.on_upgrade = [&told](std::int64_t from) {
    told.push_back(from);
  };
  Make();
  Open();
  const auto events = store_->ListEvents(0, 100).value();
  ASSERT_EQ(events.size(), events_before_ + 1);
  EXPECT_EQ(events.back().kind, EventKind::kUpgraded);
  EXPECT_EQ(events.back().author, "atlasd");
  EXPECT_EQ(events.back().detail, "from version " + std::to_string(GetParam().version));
  EXPECT_EQ(events.back().revision, store_->ReadCounts()->revision);
  store_.reset();
  const auto dump = testing::DumpStore(Database());
  Open();
  store_.reset();
  EXPECT_TRUE(testing::DumpStore(Database()) == dump);
  EXPECT_EQ(told, std::vector<std::int64_t>{GetParam().version});
}

// Keyframe 4, night/1, was moved 9 m east for a while.
TEST_P(MigrationTest, EarlierRevisionsAreRead) {
  const TileId east{0, 1, 0};
  Make();
  const bool is_kept = !HasTable("compactions") || Ask("SELECT count(*) FROM compactions") == 0;
  Open();
  const std::uint64_t now = store_->revision();
  if (!is_kept) {
    EXPECT_EQ(store_->GatherTileAt(east, 1).error().code(), StatusCode::kNotFound);
    return;
  }
  EXPECT_TRUE(PlacesAt(east, 0).empty());
  std::map<std::int64_t, std::uint64_t> revisions;  // of each place
  for (std::uint64_t revision = 1; revision <= now; ++revision) {
    const auto places = PlacesAt(east, revision);
    if (places.contains(4)) {
      ++revisions[places.at(4)];
    }
  }
  EXPECT_EQ(PlacesAt(east, now).at(4), -4'500'000);
  EXPECT_GT(revisions[-4'500'000], 1u);
  EXPECT_GT(revisions[4'500'000], 1u);
  EXPECT_EQ(revisions.size(), 2u);
  const auto sources = store_->GatherTile(east, 0).value();
  for (const KeyframeRecord& record : sources.keyframes) {
    EXPECT_NE(record.id, 4);
  }
}

TEST_P(MigrationTest, ItGoesOn) {
  Make();
  const std::int64_t last = Ask("SELECT value FROM counters WHERE name = 'last_keyframe_id'");
  const std::int64_t revision = Ask("SELECT value FROM counters WHERE name = 'revision'");
  Open();
  NewKeyframe keyframe = MakeKeyframe(0, {{0, 0, 0}});
  keyframe.key.session.session = "new";
  const auto put = Put(keyframe);
  ASSERT_TRUE(put.has_value()) << put.error().message();
  EXPECT_EQ(put->revision, static_cast<std::uint64_t>(revision) + 1);
  EXPECT_EQ(Ids().back(), last + 1);
  const auto change = [&](SessionAction action) {
    return Await<SessionChangeResult>([&](auto done) {
             store_->ChangeSession({{"bus", "day"}, action, "tester", ""}, std::move(done));
           })
        .value();
  };
  const auto retracted = change(SessionAction::kRetract);
  EXPECT_TRUE(retracted.is_changed);
  EXPECT_GT(retracted.tiles_marked, 0u);
  EXPECT_EQ(change(SessionAction::kRestore).state, SessionState::kLive);
  EXPECT_TRUE(store_->CheckCounters().ok());
  Open();
  EXPECT_EQ(store_->FindSession({"bus", "new"}).value()->keyframes, 1u);
}

TEST_P(MigrationTest, WithoutTheDaemonItIsReadOnceItWasOpened) {
  Make();
  const auto before = StoreSnapshot::Open(Database());
  ASSERT_EQ(before.has_value(), GetParam().version >= kFirstReadableVersion);
  if (!before) {
    EXPECT_EQ(before.error().code(), StatusCode::kUnsupported);
    EXPECT_THAT(before.error().message(), HasSubstr("open it once with atlasd"));
  }
  EXPECT_EQ(testing::SchemaVersionOf(Database()), GetParam().version);
  Open();
  store_.reset();
  const auto snapshot = StoreSnapshot::Open(Database());
  EXPECT_TRUE(snapshot.has_value()) << snapshot.error().message();
}

TEST_P(MigrationTest, WhatCannotBeUpgradedStaysAsItWas) {
  const std::string version = std::to_string(GetParam().version);
  std::vector<std::pair<std::string, StatusCode>> cases = {
      {"PRAGMA user_version = 0", StatusCode::kUnsupported},
      {"PRAGMA user_version = -1", StatusCode::kUnsupported},
      {"PRAGMA user_version = " + std::to_string(kStoreSchemaVersion + 1),
       StatusCode::kUnsupported},
      {"PRAGMA application_id = 7", StatusCode::kInvalidData},
      {"UPDATE meta SET epoch = epoch + 1", StatusCode::kInvalidData},
      {"DELETE FROM meta", StatusCode::kInvalidData},
  };
  if (GetParam().version < 5) {
    cases.emplace_back("CREATE TABLE table_sums (x)", StatusCode::kInvalidData);
    cases.emplace_back("DROP TABLE dirty_tiles", StatusCode::kInvalidData);
    cases.emplace_back(
        "PRAGMA writable_schema = ON; UPDATE sqlite_master SET "
        "sql = replace(sql, 'z_um INTEGER', 'z_um INTEGES') WHERE name = 'poses'",
        StatusCode::kInvalidData);
  }
  for (const auto& [damage, code] : cases) {
    SCOPED_TRACE(damage);
    fs::remove_all(options_.directory);
    Make();
    Tamper(damage);
    const auto dump = testing::DumpStore(Database());
    EXPECT_EQ(OpenCode(), code);
    EXPECT_TRUE(testing::DumpStore(Database()) == dump);
  }
}

TEST_P(MigrationTest, AFileThatMayNotBeWrittenStaysAsItWas) {
  Make();
  const auto dump = testing::DumpStore(Database());
  fs::permissions(directory_, fs::perms(0755));
  fs::permissions(options_.directory, fs::perms(0777));
  fs::permissions(Database(), fs::perms(0444));
  {
    const AsNobody nobody;
    EXPECT_EQ(OpenCode(), StatusCode::kPermissionDenied);
  }
  EXPECT_TRUE(testing::DumpStore(Database()) == dump);
}

TEST_P(MigrationTest, DamagedRowsStopNothingAndStayDamaged) {
  struct Damage {
    std::string table;
    std::string sql;
    std::function<StatusCode()> read;
  };
  const auto code = [](const auto& result) {
    return result ? StatusCode::kOk : result.error().code();
  };
  const SessionKey day{"bus", "day"};
  const std::vector<Damage> damages = {
      {"keyframes", "UPDATE keyframes SET radius_cells = 2000000000 WHERE id = 2",
       [&] {
         return code(store_->ReadKeyframe(2));
       }},
      {"keyframes", "UPDATE keyframes SET blob_bytes = 9000000000000000000",
       [&] {
         return code(store_->ReadKeyframeBlob(2));
       }},
      {"poses", "UPDATE poses SET x_um = 9223372036854775807 WHERE keyframe_id = 2",
       [&] {
         return code(store_->ReadKeyframe(2));
       }},
      {"pose_history", "UPDATE pose_history SET y_um = 9223372036854775807 WHERE keyframe_id = 2",
       [&] {
         return code(store_->ReadKeyframe(2));
       }},
      {"session_states", "UPDATE session_states SET reason = 'x' WHERE session_id = 1",
       [&] {
         return store_->CheckSession(day).code();
       }},
      {"compactions", "UPDATE compactions SET author = 'x'",
       [&] {
         return store_->CheckCompactions().code();
       }},
      {"tombstones", "UPDATE tombstones SET time_ms = 7",
       [&] {
         return store_->CheckSession({"bus", "night"}).code();
       }},
  };
  for (const auto& [table, sql, read] : damages) {
    SCOPED_TRACE(sql);
    fs::remove_all(options_.directory);
    Make();
    if (!HasTable(table) || Ask("SELECT count(*) FROM " + table) == 0) {
      continue;
    }
    Tamper(sql);
    Open();
    ASSERT_TRUE(store_ != nullptr);
    EXPECT_EQ(read(), StatusCode::kInvalidData);
    EXPECT_GE(store_->ListEvents(0, 10).value().size(), 1u);
    NewKeyframe keyframe = MakeKeyframe(0, {{0, 0, 0}});
    keyframe.key.session.session = "new";
    EXPECT_TRUE(Put(keyframe).has_value());
    store_.reset();
  }
}

// Whoever opens an atlas makes such a row from others, if its checksum says that it was that: an
// older one, of a value less, does not.
TEST_P(MigrationTest, ADamagedSessionIsNotBelieved) {
  Make();
  const bool is_older = !HasTable("tombstones");
  const std::int64_t bytes = Ask("SELECT bytes FROM sessions WHERE session = 'day'");
  Tamper("UPDATE sessions SET bytes = bytes + 1 WHERE session = 'day'");
  Open();
  const auto session = store_->FindSession({"bus", "day"});
  const auto events = store_->ListEvents(0, 10).value();
  if (is_older) {
    ASSERT_FALSE(session.has_value());
    EXPECT_EQ(session.error().code(), StatusCode::kInvalidData);
    EXPECT_EQ(events.size(), events_before_ + 1);
    return;
  }
  ASSERT_TRUE(session.has_value()) << session.error().message();
  EXPECT_EQ((*session)->bytes, static_cast<std::uint64_t>(bytes));
  ASSERT_EQ(events.size(), events_before_ + 2);
  EXPECT_EQ(events.back().kind, EventKind::kTablesRepaired);
}

TEST_P(MigrationTest, ATileThatIsDamagedStaysSo) {
  Make();
  if (GetParam().version == 1) {
    Open();
    EXPECT_EQ(store_->ReadCounts()->tiles, 0u) << "of a format that nobody reads";
    return;
  }
  Tamper("UPDATE tiles SET cells = 9000000000000000000");
  Open();
  const auto tiles = store_->ListTiles(-1, 1'000).value();
  ASSERT_FALSE(tiles.empty());
  EXPECT_EQ(store_->ReadTile(tiles[0].id).error().code(), StatusCode::kInvalidData);
}

TEST_P(MigrationTest, NumbersThatRowsTellAreCountedAgain) {
  Make();
  const std::int64_t revision = Ask("SELECT max(revision) FROM pose_history");
  const std::int64_t sessions = Ask("SELECT count(*) FROM sessions");
  Tamper(
      "UPDATE counters SET value = 99 WHERE name = 'keyframes';"
      "UPDATE counters SET value = 1 WHERE name IN ('revision', 'sessions', 'last_keyframe_id')");
  Open();
  if (GetParam().version < 5) {  // else they are restored as ever
    EXPECT_THAT(Detail(), HasSubstr("it counted 99 keyframes, and the rows say "));
  }
  EXPECT_TRUE(store_->CheckCounters().ok());
  EXPECT_GE(store_->revision(), static_cast<std::uint64_t>(revision));
  NewKeyframe keyframe = MakeKeyframe(0, {{0, 0, 0}});
  keyframe.key.session.session = "new";
  EXPECT_TRUE(Put(keyframe).has_value());
  EXPECT_EQ(store_->ListSessions({}, 1'000).value().size(), static_cast<std::size_t>(sessions) + 1);
}

TEST_P(MigrationTest, ASessionThatWasLostIsMissed) {
  Make();
  Tamper("DELETE FROM sessions WHERE id = 1");
  Open();
  if (GetParam().version < 5) {
    EXPECT_THAT(Detail(), HasSubstr("rows of 1 sessions are lost"));
  } else {
    EXPECT_FALSE(store_->CheckCounters().ok()) << "the upgrade does not make it good";
  }
  EXPECT_EQ(store_->ReadKeyframe(2).error().code(), StatusCode::kInvalidData) << "it was of it";
  const std::size_t left = store_->ListSessions({}, 1'000).value().size();
  NewKeyframe keyframe = MakeKeyframe(0, {{0, 0, 0}});
  keyframe.key.session.session = "new";
  EXPECT_TRUE(Put(keyframe).has_value());
  EXPECT_EQ(store_->ListSessions({}, 1'000).value().size(), left + 1) << "in the place of another";
}

}  // namespace
}  // namespace atlas
