// The daemon's file read without the daemon: while it runs, after it stopped, after it was killed,
// and as a copy in a folder that nobody writes to. Always the daemon's own answers.
#include <csignal>
#include <fstream>
#include <regex>

#include <sqlite3.h>

#include "client/atlas_file/file_feed.h"
#include "client/vehicle/atlas_view.h"
#include "tests/client/end_to_end/end_to_end_fixture.h"
#include "tests/server/store/as_nobody.h"

namespace atlas {
namespace {

class AtlasFileEndToEndTest : public EndToEndTest {
 protected:
  using Arguments = std::vector<std::string>;

  static CommandRun RunOn(const fs::path& file, Arguments arguments) {
    arguments.insert(arguments.end(), {"--atlas", file.string()});
    return RunAtlas("127.0.0.1:9", std::move(arguments));  // where nobody listens
  }
  // What the commands print, but for how long it took and what was received, and the picture.
  template <typename RunCommand>
  static std::vector<std::string> Answers(RunCommand run) {
    const std::regex varying(R"x("(ms|hz|bytes_received)":[^,}]*)x");
    const fs::path picture = shared_root / "map.png";
    const std::vector<Arguments> commands = {
        {"point", "0", "-3"},
        {"point", "-5000", "5000"},
        {"plan", "--from", "-30,-2,0", "--to", "30,-2,0"},
        {"plan", "--from", "-30,-2,0", "--to", "2,30,5.5"},
        {"render", "-o", picture.string(), "--color", "layers"},
        {"localize", shared_drive.string(), "--scans", "odd", "--perturb", "0.3,1", "--trials", "1",
         "--max-range", "25"}};
    std::vector<std::string> answers;
    for (const Arguments& command : commands) {
      const CommandRun done = run(command);
      answers.push_back(std::to_string(done.exit_code) + " " +
                        std::regex_replace(done.out, varying, "") + done.err);
    }
    std::ifstream in(picture, std::ios::binary);
    answers.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
    fs::remove(picture);
    return answers;
  }
  static std::vector<std::string> AnswersOf(const fs::path& file) {
    return Answers([&file](const Arguments& arguments) { return RunOn(file, arguments); });
  }
  static std::vector<std::string> AnswersOf(const DaemonProcess& daemon) {
    return Answers(
        [&daemon](const Arguments& arguments) { return RunAtlas(daemon.address(), arguments); });
  }
  static void Fill(const DaemonProcess& daemon) {
    ASSERT_EQ(Ingest(daemon).exit_code, 0);
    ASSERT_EQ(RunAtlas(daemon.address(), {"wait"}).exit_code, 0);
  }
  // A fused atlas whose daemon stopped.
  static fs::path StoppedAtlas() {
    const fs::path data = NewData();
    DaemonProcess daemon(data, kSmall);
    Fill(daemon);
    EXPECT_EQ(daemon.Stop(SIGTERM), 0);
    return data / "atlas.db";
  }
  static void Change(const fs::path& file, const char* sql) {
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(file.c_str(), &db), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(db, sql, nullptr, nullptr, nullptr), SQLITE_OK);
    sqlite3_close(db);
  }
  static std::string BytesOf(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }
};

TEST_F(AtlasFileEndToEndTest, TheAnswersAreTheDaemons) {
  const fs::path data = NewData();
  const fs::path file = data / "atlas.db";
  const fs::path backup = NewData();
  std::vector<std::string> expected;
  {
    DaemonProcess daemon(data, kSmall);
    Fill(daemon);
    expected = AnswersOf(daemon);
    ASSERT_EQ(expected[0].substr(0, 2), "0 ");
    ASSERT_EQ(expected[5].substr(0, 2), "0 ");
    EXPECT_EQ(AnswersOf(file), expected) << "beside the daemon";
    EXPECT_EQ(daemon.Stop(SIGKILL), -SIGKILL);
    ASSERT_TRUE(fs::exists(file.string() + "-wal"));
    const std::string log = BytesOf(file.string() + "-wal");
    EXPECT_EQ(AnswersOf(file), expected) << "after it was killed";
    EXPECT_EQ(BytesOf(file.string() + "-wal"), log);
  }
  {
    DaemonProcess daemon(data, {});
    EXPECT_EQ(daemon.Stop(SIGTERM), 0);
  }
  const std::string bytes = BytesOf(file);
  const auto written = fs::last_write_time(file);
  EXPECT_EQ(AnswersOf(file), expected) << "after it stopped";
  EXPECT_EQ(fs::last_write_time(file), written);
  EXPECT_EQ(BytesOf(file), bytes);
  EXPECT_FALSE(fs::exists(file.string() + "-shm"));

  fs::create_directory(backup);
  fs::copy(file, backup / "monday.db");
  fs::permissions(backup / "monday.db", fs::perms(0444));
  fs::permissions(backup, fs::perms(0555));
  EXPECT_EQ(AnswersOf(backup / "monday.db"), expected) << "a copy";
  fs::permissions(backup, fs::perms(0755));
}

TEST_F(AtlasFileEndToEndTest, WhoMayNotWriteReadsBesideTheDaemon) {
  const fs::path data = NewData();
  DaemonProcess daemon(data, kSmall);
  Fill(daemon);
  const CommandRun expected = RunAtlas(daemon.address(), {"point", "0", "-3"});
  const AsNobody nobody;
  const CommandRun found = RunOn(data / "atlas.db", {"point", "0", "-3"});
  EXPECT_EQ(found.exit_code, 0) << found.err;
  EXPECT_EQ(found.out, expected.out);
}

TEST_F(AtlasFileEndToEndTest, TilesThatWaitToBeFusedAreNoted) {
  const fs::path file = StoppedAtlas();
  const CommandRun before = RunOn(file, {"point", "0", "-3"});
  EXPECT_EQ(before.err, "");
  Change(file,
         "INSERT INTO dirty_tiles (key, shard, level, generation, since, checksum) "
         "SELECT key, shard, 0, 1, 1, 0 FROM tiles LIMIT 2");
  const CommandRun noted = RunOn(file, {"point", "0", "-3"});
  EXPECT_EQ(noted.exit_code, 0);
  EXPECT_EQ(noted.out, before.out);
  EXPECT_NE(noted.err.find("wait to be fused: 2;"), std::string::npos) << noted.err;
}

TEST_F(AtlasFileEndToEndTest, AFileWithoutATileIsNoMapToLocalizeIn) {
  const fs::path data = NewData();
  const Arguments localize = {"localize", shared_drive.string(), "--max-range", "25"};
  {
    DaemonProcess daemon(data, kSmall);
    EXPECT_EQ(daemon.Stop(SIGTERM), 0);
  }
  const CommandRun empty = RunOn(data / "atlas.db", localize);
  EXPECT_EQ(empty.exit_code, 3);
  EXPECT_EQ(empty.out, "");
  EXPECT_NE(empty.err.find("the atlas is empty"), std::string::npos) << empty.err;
  const fs::path file = StoppedAtlas();
  Change(file,
         "INSERT INTO dirty_tiles (key, shard, level, generation, since, checksum) "
         "SELECT key, shard, 0, 1, 1, 0 FROM tiles LIMIT 2; DELETE FROM tiles");
  const CommandRun waiting = RunOn(file, localize);
  EXPECT_EQ(waiting.exit_code, 3);
  EXPECT_NE(waiting.err.find("2 tiles wait to be fused (atlasd"), std::string::npos) << waiting.err;
}

TEST_F(AtlasFileEndToEndTest, WhatIsNoAtlasFileHasItsExitCode) {
  const fs::path file = StoppedAtlas();
  const fs::path text = shared_root / "text.db";
  std::ofstream(text) << "no atlas\n";
  const std::vector<Arguments> commands = {{"point", "0", "-3"},
                                           {"plan", "--from", "0,-2,0", "--to", "3,-2,0"},
                                           {"render", "-o", (shared_root / "never.png").string()},
                                           {"localize", shared_drive.string(), "--scans", "odd"}};
  for (const Arguments& command : commands) {
    const CommandRun missing = RunOn(shared_root / "nowhere.db", command);
    EXPECT_EQ(missing.exit_code, 3) << missing.err;
    EXPECT_NE(missing.err.find("nowhere.db"), std::string::npos) << missing.err;
    EXPECT_FALSE(fs::exists(shared_root / "nowhere.db"));
    EXPECT_EQ(RunOn(file.parent_path(), command).exit_code, 2);
    EXPECT_EQ(RunOn(text, command).exit_code, 6);
    EXPECT_EQ(RunOn(text, command).out, "");
  }
  EXPECT_FALSE(fs::exists(shared_root / "never.png"));
  const CommandRun past = RunOn(file, {"point", "0", "-3", "--at", "1"});
  EXPECT_EQ(past.exit_code, 2);
  EXPECT_NE(past.err.find("a daemon"), std::string::npos) << past.err;
  Change(file, "PRAGMA user_version = 99");
  const CommandRun newer = RunOn(file, commands[0]);
  EXPECT_EQ(newer.exit_code, 1);
  EXPECT_NE(newer.err.find("\"unsupported\""), std::string::npos) << newer.err;
}

TEST_F(AtlasFileEndToEndTest, ADamagedTileIsNamed) {
  const fs::path file = StoppedAtlas();
  Change(file, "UPDATE tiles SET blob = zeroblob(blob_bytes)");
  const CommandRun point = RunOn(file, {"point", "0", "-3"});
  EXPECT_EQ(point.exit_code, 6);
  EXPECT_NE(point.err.find("tile 0/"), std::string::npos) << point.err;
  EXPECT_EQ(RunOn(file, {"render", "-o", (shared_root / "never.png").string()}).exit_code, 6);
}

std::vector<TileId> IdsOf(const MapAround& map) {
  std::vector<TileId> ids;
  for (const auto& tile : map.tiles) {
    ids.push_back(tile->id);
  }
  std::sort(ids.begin(), ids.end());
  return ids;
}

TEST_F(AtlasFileEndToEndTest, TheMapAroundAPoseIsTheDaemons) {
  const fs::path data = NewData();
  DaemonProcess daemon(data, kSmall);
  Fill(daemon);
  LinkOptions options;
  options.connection.endpoint = *Endpoint::Parse(daemon.address());
  AtlasLink link(options);
  auto file = AtlasFile::Open(data / "atlas.db");
  ASSERT_TRUE(file) << file.error().message();
  FileFeed feed(*file);
  AroundOptions around;
  around.deadline = std::chrono::milliseconds(60'000);
  for (const std::uint8_t level : {std::uint8_t{0}, std::uint8_t{2}}) {
    around.finest_level = level;
    TileStore from_daemon = *TileStore::Open(file->key(), {});
    TileStore from_file = *TileStore::Open(file->key(), {});
    const auto expected = AtlasView(from_daemon, &link).Around({-3.0, -4.0}, 30.0, around);
    const auto found = AtlasView(from_file, feed).Around({-3.0, -4.0}, 30.0, around);
    ASSERT_TRUE(expected && found);
    EXPECT_TRUE(expected->is_current) << expected->sync.message();
    EXPECT_TRUE(found->is_current) << found->sync.message();
    EXPECT_EQ(found->revision, expected->revision);
    EXPECT_EQ(found->finest_places, expected->finest_places);
    EXPECT_EQ(IdsOf(*found), IdsOf(*expected));
    ASSERT_EQ(from_file.Tiles(), from_daemon.Tiles());
    for (const TileId& id : from_file.Tiles()) {
      EXPECT_EQ(**from_file.Read(id), **from_daemon.Read(id)) << id;
    }
  }
}

}  // namespace
}  // namespace atlas
