// From a simulated drive to a served map and back to a pose, through the real daemon: what the
// product promises, seen from outside.
#include <csignal>
#include <fstream>
#include <set>

#include <sqlite3.h>

#include "client/render/image.h"
#include "core/scan/scan_reader.h"
#include "core/tile/tile_codec.h"
#include "tests/client/end_to_end/end_to_end_fixture.h"

namespace atlas {
namespace {

TEST_F(EndToEndTest, TwoRoadsAboveEachOtherAreTwoLayers) {
  DaemonProcess daemon(NewData(), kSmall);
  const CommandRun ingest = Ingest(daemon);
  ASSERT_EQ(ingest.exit_code, 0) << ingest.err;
  const auto keyframes = ingest.Get<std::uint64_t>("keyframes");
  EXPECT_GT(keyframes, 20U);
  EXPECT_EQ(ingest.Get<std::uint64_t>("acked"), keyframes);
  EXPECT_EQ(ingest.Get<std::uint64_t>("duplicates"), 0U);
  EXPECT_EQ(ingest.Get<std::uint64_t>("sessions"), 2U);
  EXPECT_NEAR(ingest.Get<double>("sensor_height_m"), 1.8, 0.05);

  const CommandRun wait = RunAtlas(daemon.address(), {"wait", "--timeout", "60"});
  ASSERT_EQ(wait.exit_code, 0) << wait.err;
  EXPECT_EQ(wait.Get<int>("dirty_tiles"), 0);

  const CommandRun status = RunAtlas(daemon.address(), {"status"});
  EXPECT_EQ(status.Get<std::uint64_t>("keyframes"), keyframes);
  EXPECT_GT(status.Get<std::uint64_t>("multilayer_cells"), 100U);

  const CommandRun point = RunAtlas(daemon.address(), {"point", "0", "-3"});
  ASSERT_EQ(point.exit_code, 0) << point.err;
  const auto& layers = point.json().at("layers").as_array();
  ASSERT_EQ(layers.size(), 2U);
  EXPECT_NEAR(layers[0].at("z_m").to_number<double>(), 0.0, 0.05);
  EXPECT_NEAR(layers[1].at("z_m").to_number<double>(), 5.5, 0.05);
  EXPECT_TRUE(layers[0].at("traversable").as_bool());

  const CommandRun nowhere = RunAtlas(daemon.address(), {"point", "-5000", "5000"});
  EXPECT_EQ(nowhere.exit_code, 0);
  EXPECT_TRUE(nowhere.json().at("layers").as_array().empty());

  const CommandRun sessions = RunAtlas(daemon.address(), {"sessions"});
  const auto& list = sessions.json().at("sessions").as_array();
  ASSERT_EQ(list.size(), 2U);
  EXPECT_EQ(list[1].at("session").as_string(), "overpass.2");
  EXPECT_EQ(list[0].at("state").as_string(), "live");
  EXPECT_EQ(daemon.Stop(SIGTERM), 0);
}

TEST_F(EndToEndTest, OrderBatchesDuplicatesAndRestartsLeaveTheSameAtlas) {
  const fs::path data = NewData();
  std::string digest;
  {
    DaemonProcess daemon(data, kSmall);
    ASSERT_EQ(Ingest(daemon).exit_code, 0);
    digest = Digest(daemon);
    EXPECT_EQ(digest.size(), 64U);
    const CommandRun again = Ingest(daemon);
    EXPECT_EQ(again.exit_code, 0);
    EXPECT_EQ(again.Get<int>("duplicates"), again.Get<int>("keyframes"));
    EXPECT_EQ(Digest(daemon), digest);
    EXPECT_EQ(daemon.Stop(SIGTERM), 0);
  }
  DaemonProcess restarted(data, {});
  EXPECT_EQ(Digest(restarted), digest);
  const CommandRun verify = RunAtlas(restarted.address(), {"verify", "--rebuild"});
  EXPECT_EQ(verify.exit_code, 0) << verify.err;
  EXPECT_EQ(verify.Get<int>("mismatched"), 0);
  EXPECT_GT(verify.Get<int>("checked"), 10);

  DaemonProcess other(NewData(), kSmall);
  ASSERT_EQ(Ingest(other, {"--shuffle", "3", "--batch", "5"}).exit_code, 0);
  EXPECT_EQ(Digest(other), digest);

  DaemonProcess pieces(NewData(), kSmall);
  ASSERT_EQ(Ingest(pieces, {"--scans", "odd", "--session", "overpass"}).exit_code, 0);
  EXPECT_NE(Digest(pieces), digest);
  ASSERT_EQ(Ingest(pieces, {"--scans", "even"}).exit_code, 0);
  EXPECT_EQ(Digest(pieces), digest);
}

TEST_F(EndToEndTest, OtherContentUnderAKeyIsAConflict) {
  DaemonProcess daemon(NewData(), kSmall);
  ASSERT_EQ(Ingest(daemon).exit_code, 0);
  const std::string digest = Digest(daemon);
  const CommandRun other = Ingest(daemon, {"--sensor-height", "1.7"});
  EXPECT_EQ(other.exit_code, 4);
  EXPECT_NE(other.err.find("\"conflict\""), std::string::npos) << other.err;
  // Several are under way at a time; which is refused first is not said.
  EXPECT_NE(other.err.find("keyframe vehicle/overpass/"), std::string::npos) << other.err;
  EXPECT_EQ(Digest(daemon), digest);
}

TEST_F(EndToEndTest, ScansThatSeeNothingAreCounted) {
  const fs::path blind = shared_root / "blind";
  fs::copy(shared_drive, blind, fs::copy_options::recursive);
  std::ofstream(blind / "velodyne" / "000003.bin", std::ios::binary)
      << std::string(16 * 100, '\0');  // a hundred returns at the sensor itself
  DaemonProcess daemon(NewData(), kSmall);
  EXPECT_EQ(Ingest(daemon).Get<int>("empty_scans"), 0);
  const CommandRun run =
      RunAtlas(daemon.address(), {"ingest", blind.string(), "--every", "0", "--range", "0:10"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.Get<int>("empty_scans"), 1);
  EXPECT_NE(run.err.find("1 of 10 scans"), std::string::npos) << run.err;
}

TEST_F(EndToEndTest, QueriesKeepTheirBudgetAndComeCoarseFirst) {
  DaemonProcess daemon(NewData(), kSmall);
  ASSERT_EQ(Ingest(daemon).exit_code, 0);
  ASSERT_EQ(RunAtlas(daemon.address(), {"wait"}).exit_code, 0);
  const fs::path tiles = shared_root / "tiles";
  const CommandRun query = RunAtlas(
      daemon.address(), {"query", "--center", "-3,-4", "--radius", "30", "-o", tiles.string()});
  ASSERT_EQ(query.exit_code, 0) << query.err;
  EXPECT_EQ(query.json().at("type").as_string(), "summary");
  EXPECT_FALSE(query.json().at("truncated").as_bool());
  ASSERT_EQ(query.Get<std::size_t>("tiles") + 1, query.lines.size());
  MapProfile profile;
  profile.cell_size_um = 200'000;
  std::int64_t last_level = 99;
  for (std::size_t i = 0; i + 1 < query.lines.size(); ++i) {
    const auto& line = query.lines[i];
    const auto level = line.at("level").to_number<std::int64_t>();
    EXPECT_LE(level, last_level);
    last_level = level;
    const std::string name = std::to_string(level) + "_" +
                             std::to_string(line.at("x").to_number<int>()) + "_" +
                             std::to_string(line.at("y").to_number<int>()) + ".tile";
    const auto blob = ReadFileBytes(tiles / name, kMaxTileBytes);
    ASSERT_TRUE(blob) << name;
    EXPECT_EQ(blob->size(), line.at("bytes").to_number<std::size_t>());
    EXPECT_TRUE(DecodeTile(*blob, profile)) << name;
  }
  EXPECT_EQ(last_level, 0);

  const auto bytes = query.Get<std::uint64_t>("bytes");
  const CommandRun half = RunAtlas(daemon.address(), {"query", "--center", "-3,-4", "--radius",
                                                      "30", "--budget", std::to_string(bytes / 2)});
  ASSERT_EQ(half.exit_code, 0) << half.err;
  EXPECT_TRUE(half.json().at("truncated").as_bool());
  EXPECT_LE(half.Get<std::uint64_t>("bytes"), bytes / 2);
  EXPECT_LT(half.lines.size(), query.lines.size());

  const CommandRun coarse =
      RunAtlas(daemon.address(), {"query", "--center", "-3,-4", "--radius", "30", "--level", "2"});
  for (std::size_t i = 0; i + 1 < coarse.lines.size(); ++i) {
    EXPECT_GE(coarse.lines[i].at("level").to_number<int>(), 2);
  }
}

// "vehicle overpass N" with the pose of scan N moved by `dx_m`.
void WritePoses(const fs::path& poses, const fs::path& file, int scan, double dx_m) {
  std::ifstream in(poses);
  std::string line;
  for (int i = 0; i <= scan; ++i) {
    std::getline(in, line);
  }
  std::istringstream numbers(line);
  std::ofstream out(file);
  out.precision(17);
  out << "vehicle overpass " << scan;
  for (int i = 0; i < 12; ++i) {
    double number = 0.0;
    numbers >> number;
    out << ' ' << number + (i == 3 ? dx_m : 0.0);
  }
  out << '\n';
}

TEST_F(EndToEndTest, PosesThereAndBackLeaveTheSameAtlas) {
  DaemonProcess daemon(NewData(), kSmall);
  ASSERT_EQ(Ingest(daemon).exit_code, 0);
  const std::string digest = Digest(daemon);
  const fs::path file = shared_root / "corrections.txt";

  WritePoses(shared_drive / "poses.txt", file, 3, 0.5);
  const CommandRun there = RunAtlas(daemon.address(), {"poses", "apply", file.string()});
  ASSERT_EQ(there.exit_code, 0) << there.err;
  EXPECT_EQ(there.Get<int>("updated"), 1);
  EXPECT_GT(there.Get<int>("tiles_marked"), 0);
  EXPECT_NE(Digest(daemon), digest);

  WritePoses(shared_drive / "poses.txt", file, 3, 0.0);
  ASSERT_EQ(RunAtlas(daemon.address(), {"poses", "apply", file.string()}).exit_code, 0);
  EXPECT_EQ(Digest(daemon), digest);
  const CommandRun same = RunAtlas(daemon.address(), {"poses", "apply", file.string()});
  EXPECT_EQ(same.Get<int>("updated"), 0);
  EXPECT_EQ(same.Get<int>("tiles_marked"), 0);

  std::ofstream(file, std::ios::app) << "vehicle overpass 9999 1 0 0 0 0 1 0 0 0 0 1 0\n";
  EXPECT_EQ(RunAtlas(daemon.address(), {"poses", "apply", file.string()}).exit_code, 3);
  std::ofstream(file) << "vehicle overpass 3 1 0 0 0 0 0 -1 0 0 1 0 0\n";  // on its side
  EXPECT_EQ(RunAtlas(daemon.address(), {"poses", "apply", file.string()}).exit_code, 6);
  EXPECT_EQ(Digest(daemon), digest);
}

TEST_F(EndToEndTest, TheMapIsDrawnPlannedAndLocalizedIn) {
  DaemonProcess daemon(NewData(), kSmall);
  ASSERT_EQ(Ingest(daemon).exit_code, 0);
  ASSERT_EQ(RunAtlas(daemon.address(), {"wait"}).exit_code, 0);

  const fs::path picture = shared_root / "map.png";
  const CommandRun render = RunAtlas(daemon.address(), {"render", "-o", picture.string()});
  ASSERT_EQ(render.exit_code, 0) << render.err;
  EXPECT_DOUBLE_EQ(render.Get<double>("metres_per_pixel"), 0.2);
  EXPECT_GT(fs::file_size(picture), 1000U);

  const CommandRun plan =
      RunAtlas(daemon.address(), {"plan", "--from", "-30,-2,0", "--to", "30,-2,0"});
  ASSERT_EQ(plan.exit_code, 0) << plan.err;
  EXPECT_TRUE(plan.json().at("found").as_bool());
  EXPECT_NEAR(plan.Get<double>("length_m"), 60.0, 6.0);
  const CommandRun up =
      RunAtlas(daemon.address(), {"plan", "--from", "-30,-2,0", "--to", "2,30,5.5"});
  EXPECT_EQ(up.exit_code, 3);
  EXPECT_FALSE(up.json().at("found").as_bool());

  const CommandRun localize =
      RunAtlas(daemon.address(), {"localize", shared_drive.string(), "--perturb", "0.3,1",
                                  "--trials", "2", "--max-range", "25"});
  ASSERT_EQ(localize.exit_code, 0) << localize.err;
  EXPECT_EQ(localize.lines.size(), 2 * localize.Get<std::size_t>("scans") + 1);
  EXPECT_EQ(localize.lines.front().at("pose").as_array().size(), 12U);
}

void DamageFirstKeyframe(const fs::path& data) {
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open((data / "atlas.db").c_str(), &db), SQLITE_OK);
  const char* const sql = "UPDATE keyframes SET blob = zeroblob(length(blob)) WHERE id = 1";
  EXPECT_EQ(sqlite3_exec(db, sql, nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(db);
}

TEST_F(EndToEndTest, DamageEndsWaitsAndIsNamed) {
  const fs::path data = NewData();
  {
    DaemonProcess daemon(data, kSmall);
    ASSERT_EQ(Ingest(daemon).exit_code, 0);
    ASSERT_EQ(RunAtlas(daemon.address(), {"wait"}).exit_code, 0);
    EXPECT_EQ(daemon.Stop(SIGTERM), 0);
  }
  DamageFirstKeyframe(data);
  DaemonProcess daemon(data, {});
  EXPECT_EQ(RunAtlas(daemon.address(), {"wait"}).exit_code, 0);  // nothing asks for it yet

  const fs::path file = shared_root / "beside_damage.txt";
  WritePoses(shared_drive / "poses.txt", file, 1, 0.5);
  ASSERT_EQ(RunAtlas(daemon.address(), {"poses", "apply", file.string()}).exit_code, 0);
  for (const char* command : {"wait", "digest"}) {
    const CommandRun run = RunAtlas(daemon.address(), {command});
    EXPECT_EQ(run.exit_code, 6) << command;
    EXPECT_NE(run.err.find("\"invalid_data\""), std::string::npos) << run.err;
    EXPECT_NE(run.err.find("keyframe vehicle/overpass"), std::string::npos) << run.err;
  }
  const CommandRun status = RunAtlas(daemon.address(), {"status"});
  EXPECT_GT(status.Get<int>("damaged_tiles"), 0);
  EXPECT_EQ(status.Get<int>("damaged_tiles"), status.Get<int>("dirty_tiles"));
  const CommandRun query =
      RunAtlas(daemon.address(), {"query", "--center", "-3,-4", "--radius", "30"});
  EXPECT_EQ(query.exit_code, 0) << query.err;
  EXPECT_EQ(RunAtlas(daemon.address(), {"verify", "--rebuild"}).exit_code, 6);
  EXPECT_EQ(daemon.Stop(SIGTERM), 0);
}

TEST_F(EndToEndTest, SecondDaemonOnTheSameDataIsRefused) {
  const fs::path data = NewData();
  DaemonProcess daemon(data, kSmall);
  EXPECT_THROW(DaemonProcess(data, {}), std::runtime_error);
  EXPECT_EQ(RunAtlas(daemon.address(), {"status"}).exit_code, 0);
}

}  // namespace
}  // namespace atlas
