// `atlas poses apply` on a condition and `atlas poses undo` with the real daemon; keyframes read
// back from it, and from its file.
#include <csignal>
#include <fstream>
#include <map>

#include "client/atlas_file/atlas_file.h"
#include "tests/client/end_to_end/vehicle_fixture.h"

namespace atlas {
namespace {

class PoseBatchesEndToEndTest : public VehicleTest {
 protected:
  // Corrections of the first scans of the drive, all moved along x.
  static std::string CorrectionFile(double dx_m) {
    const fs::path file = shared_root / "corrections.txt";
    std::ifstream poses(shared_drive / "poses.txt");
    std::ofstream out(file);
    std::string line;
    for (int scan = 0; scan < 3 && std::getline(poses, line); ++scan) {
      std::istringstream numbers(line);
      out << "vehicle overpass " << scan;
      for (int i = 0; i < 12; ++i) {
        double number = 0.0;
        numbers >> number;
        out << ' ' << (i == 3 ? number + dx_m : number);
      }
      out << '\n';
    }
    return file.string();
  }
  static CommandRun Apply(const DaemonProcess& daemon,
                          double dx_m,
                          const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"poses", "apply", CorrectionFile(dx_m)};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunAtlas(daemon.address(), arguments);
  }
  static CommandRun Undo(const DaemonProcess& daemon, const std::string& batch) {
    return RunAtlas(daemon.address(), {"poses", "undo", batch, "--author", "alice"});
  }
  static std::string Revision(const DaemonProcess& daemon) {
    return std::to_string(RunAtlas(daemon.address(), {"status"}).Get<std::uint64_t>("revision"));
  }
  static constexpr int kConflict = static_cast<int>(ExitCode::kConflict);
};

TEST_F(PoseBatchesEndToEndTest, AnUndoneBatchLeavesTheAtlasThatNeverSawIt) {
  const DaemonProcess never(NewData(), kSmall);
  const DaemonProcess daemon(NewData(), kSmall);
  for (const DaemonProcess* each : {&never, &daemon}) {
    ASSERT_EQ(Ingest(*each, {"--staged"}).exit_code, 0);
    ASSERT_EQ(Ingest(*each, {"--session", "live", "--range", "0:6"}).exit_code, 0);
  }
  const std::string before = Digest(never);
  ASSERT_EQ(Digest(daemon), before);
  const CommandRun applied =
      Apply(daemon, 0.4,
            {"--if-revision", Revision(daemon), "--publish", "vehicle/overpass", "--publish",
             "vehicle/overpass.2", "--author", "merge"});
  ASSERT_EQ(applied.exit_code, 0) << applied.err;
  EXPECT_EQ(applied.Get<int>("updated"), 3);
  EXPECT_EQ(applied.Get<int>("batch"), 1);
  ASSERT_EQ(applied.json().at("sessions").as_array().size(), 2U);
  EXPECT_EQ(applied.json().at("sessions").at(0).at("state").as_string(), "live");
  const std::string merged = Digest(daemon);
  EXPECT_NE(merged, before);
  const CommandRun undone = Undo(daemon, "1");
  ASSERT_EQ(undone.exit_code, 0) << undone.err;
  EXPECT_EQ(undone.Get<int>("batch"), 2);
  EXPECT_EQ(undone.json().at("sessions").at(0).at("state").as_string(), "staged");
  EXPECT_EQ(Digest(daemon), before);
  EXPECT_EQ(Undo(daemon, "1").exit_code, kConflict);
  ASSERT_EQ(Undo(daemon, "2").exit_code, 0);
  EXPECT_EQ(Digest(daemon), merged);
  const CommandRun log = RunAtlas(daemon.address(), {"log"});
  for (const char* const line :
       {"published: vehicle/overpass, vehicle/overpass.2", "\"poses_undone\",\"author\":\"alice\"",
        "batch 1: 3 poses", "staged again: vehicle/overpass", "\"session_published\"",
        "\"session_staged\""}) {
    EXPECT_NE(log.out.find(line), std::string::npos) << line << " in " << log.out;
  }
}

TEST_F(PoseBatchesEndToEndTest, WhatChangedSinceIsAConflict) {
  const DaemonProcess daemon(NewData(), kSmall);
  ASSERT_EQ(Ingest(daemon).exit_code, 0);
  const std::string computed_at = Revision(daemon);
  ASSERT_EQ(Ingest(daemon, {"--session", "other", "--range", "0:3"}).exit_code, 0);
  ASSERT_EQ(Apply(daemon, 0.4, {"--if-revision", computed_at}).exit_code, 0);
  const CommandRun refused = Apply(daemon, 0.8, {"--if-revision", computed_at});
  EXPECT_EQ(refused.exit_code, kConflict);
  EXPECT_NE(refused.err.find("session vehicle/overpass changed since revision " + computed_at),
            std::string::npos)
      << refused.err;
  EXPECT_NE(refused.err.find("corrected by batch 1"), std::string::npos) << refused.err;
  const CommandRun to_come = Apply(daemon, 0.8, {"--if-revision", "999999"});
  EXPECT_EQ(to_come.exit_code, static_cast<int>(ExitCode::kUsage)) << to_come.err;
  EXPECT_EQ(Undo(daemon, "7").exit_code, static_cast<int>(ExitCode::kNotFound));
  ASSERT_EQ(Apply(daemon, 0.6).exit_code, 0);
  const CommandRun corrected = Undo(daemon, "1");
  EXPECT_EQ(corrected.exit_code, kConflict);
  EXPECT_NE(corrected.err.find("keyframe vehicle/overpass/0 was corrected since, by batch 2"),
            std::string::npos)
      << corrected.err;
}

TEST_F(PoseBatchesEndToEndTest, TheDaemonAndItsFileTellTheSameKeyframes) {
  const fs::path data = NewData();
  DaemonProcess daemon(data, kSmall);
  ASSERT_EQ(Ingest(daemon).exit_code, 0);
  ASSERT_EQ(Ingest(daemon, {"--session", "staged", "--staged", "--range", "0:3"}).exit_code, 0);
  ASSERT_EQ(Apply(daemon, 0.4).exit_code, 0);
  AtlasClient client = Connect(daemon);
  const auto sessions = client.ListSessions({}, SessionDetail::kChanges);
  ASSERT_TRUE(sessions) << sessions.error().message();
  ASSERT_GE(sessions->size(), 3U);
  auto file = AtlasFile::Open(data / "atlas.db");
  ASSERT_TRUE(file) << file.error().message();
  const auto listed = file->ListSessions();
  ASSERT_TRUE(listed) << listed.error().message();
  ASSERT_EQ(listed->size(), sessions->size());
  EXPECT_TRUE(file->ListSessions("nobody")->empty());
  for (std::size_t i = 0; i < sessions->size(); ++i) {
    const SessionSummary& session = (*sessions)[i];
    EXPECT_EQ((*listed)[i].key, session.key);
    EXPECT_EQ((*listed)[i].state, session.state);
    EXPECT_EQ((*listed)[i].changed_revision, session.changed_revision);
    EXPECT_GT(session.changed_revision, 0U);
    std::vector<SessionKeyframe> told;
    const auto read = client.ReadKeyframes(session.key, std::nullopt, [&](SessionKeyframe one) {
      told.push_back(std::move(one));
      return Status();
    });
    ASSERT_TRUE(read) << read.error().message();
    EXPECT_EQ(read->keyframes, session.keyframes);
    EXPECT_GE(read->revision, session.changed_revision);
    std::size_t next = 0;
    const auto again =
        file->ReadKeyframes(session.key, std::nullopt, [&](const SessionKeyframe& one) {
          EXPECT_LT(next, told.size());
          const SessionKeyframe& other = told.at(next++);
          EXPECT_EQ(one.sequence, other.sequence);
          EXPECT_EQ(one.time_ms, other.time_ms);
          EXPECT_EQ(one.T_world_sensor, other.T_world_sensor);
          EXPECT_EQ(one.blob, other.blob);
          return Status();
        });
    ASSERT_TRUE(again) << again.error().message();
    EXPECT_EQ(next, told.size());
    const auto listing = client.ListKeyframes(session.key);
    ASSERT_TRUE(listing);
    EXPECT_EQ(listing->front().T_world_sensor, told.front().T_world_sensor) << "as it is now";
  }
  EXPECT_EQ(file->ReadKeyframes({"vehicle", "nobody"}, std::nullopt, nullptr).error().code(),
            StatusCode::kNotFound);
}

}  // namespace
}  // namespace atlas
