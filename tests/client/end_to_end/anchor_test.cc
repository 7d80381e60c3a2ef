// `atlas ingest --anchor` with the real daemon: a drive with a frame of its own, in worlds whose
// truth is exact.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <iomanip>
#include <map>

#include "client/drive/anchor/anchor_fit.h"
#include "client/drive/drive_selection.h"
#include "core/scan/drive_folder.h"
#include "tests/client/end_to_end/vehicle_fixture.h"

namespace atlas {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

// What is wrong with a drive's own poses from one scan to another.
struct Bend {
  std::size_t begin = 0;
  std::size_t end = 0;
  Eigen::Vector3d step_m = Eigen::Vector3d::Zero();
  double roll_deg = 0.0;
};

class AnchorTest : public VehicleTest {
 protected:
  static void SetUpTestSuite() {
    VehicleTest::SetUpTestSuite();
    WriteStreet(shared_root / "street", 0);
    WriteStreet(shared_root / "other_lane", 2);
    WriteMoved(shared_root / "other_lane", shared_root / "moved", {Far()});
  }
  static LevelTransform Far() { return {137.3 * kDegree, {512.5, -1'234.25, 17.5}}; }
  // The same drive in another frame: each part behind a jump in one of its own.
  static void WriteMoved(const fs::path& from,
                         const fs::path& to,
                         const std::vector<LevelTransform>& T_moved_world,
                         const Bend& bend = {}) {
    fs::copy(from, to, fs::copy_options::recursive);
    const DriveFolder drive = OpenDriveFolder(from).value();
    std::ofstream poses(to / "poses.txt");
    poses << std::setprecision(17);
    std::size_t part = 0;
    std::uint32_t line = 0;
    for (std::size_t i = 0; i < drive.scans.size(); ++i) {
      part += i > 0 && IsJump(drive.scans[i - 1], drive.scans[i]) ? 1U : 0U;
      Pose pose = T_moved_world.at(part).ToPose() * drive.scans[i].T_world_sensor;
      if (i >= bend.begin && i < bend.end) {
        pose.translation() += bend.step_m;
        pose.linear() *=
            Eigen::AngleAxisd(bend.roll_deg * kDegree, Eigen::Vector3d::UnitX()).toRotationMatrix();
      }
      for (; line <= drive.scans[i].number; ++line) {  // those between have no scan
        for (const double number : PoseToRowMajor(pose)) {
          poses << number << ' ';
        }
        poses << '\n';
      }
    }
  }
  static void Map(const DaemonProcess& daemon, const fs::path& drive) {
    const CommandRun run =
        RunAtlas(daemon.address(), {"ingest", drive.string(), "--session", "map", "--every", "0"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
  }
  static CommandRun Anchor(const DaemonProcess& daemon,
                           const fs::path& drive,
                           std::vector<std::string> more = {}) {
    std::vector<std::string> arguments = {"ingest", drive.string(), "--anchor", "--every", "0"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    if (std::find(more.begin(), more.end(), "--session") == more.end()) {
      arguments.insert(arguments.end(), {"--session", "continued"});
    }
    return RunAtlas(daemon.address(), arguments);
  }
  static boost::json::object AnchorOf(const CommandRun& run, std::size_t part = 0) {
    return run.json().at("anchors").as_array().at(part).as_object();
  }
  // How far a session's keyframes are from where they were simulated, at most.
  static void ExpectAt(const DaemonProcess& daemon,
                       const std::string& session,
                       const fs::path& truth,
                       double most_m,
                       double most_deg) {
    const DriveFolder drive = OpenDriveFolder(truth).value();
    const auto keyframes = Connect(daemon).ListKeyframes({"vehicle", session});
    ASSERT_TRUE(keyframes) << keyframes.error().message();
    ASSERT_FALSE(keyframes->empty());
    for (const KeyframeSummary& keyframe : *keyframes) {
      const Pose& right = drive.scans.at(keyframe.sequence).T_world_sensor;
      const Pose stored = keyframe.T_world_sensor.ToPose();
      const Eigen::AngleAxisd turned(stored.linear().transpose() * right.linear());
      EXPECT_LT((stored.translation() - right.translation()).norm(), most_m) << keyframe.sequence;
      EXPECT_LT(turned.angle() / kDegree, most_deg) << keyframe.sequence;
    }
  }
  static std::string StateOf(const DaemonProcess& daemon, const std::string& session) {
    const auto sessions = Connect(daemon).ListSessions();
    for (const SessionSummary& summary : *sessions) {
      if (summary.key.session == session) return summary.state;
    }
    return "";
  }
};

TEST_F(AnchorTest, ADriveOfAnotherFrameGoesWhereItWasDriven) {
  const DaemonProcess daemon(NewData(), kSmall);
  Map(daemon, shared_root / "street");
  const fs::path positions = shared_root / "moved_positions.txt";
  const DriveFolder driven = OpenDriveFolder(shared_root / "other_lane").value();
  const Eigen::Vector3d p = driven.scans.at(3).T_world_sensor.translation() * 1e3;
  const std::array<std::int64_t, 3> place_mm{std::llround(p.x()) + 200, std::llround(p.y()) - 300,
                                             std::llround(p.z())};
  std::ofstream(positions) << "3 " << 1e-3 * static_cast<double>(place_mm[0]) << ' '
                           << 1e-3 * static_cast<double>(place_mm[1]) << ' '
                           << 1e-3 * static_cast<double>(place_mm[2]) << " 0.5\n";
  const CommandRun run = Anchor(daemon, shared_root / "moved", {"--positions", positions.string()});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto anchor = AnchorOf(run);
  EXPECT_TRUE(anchor.at("anchored").as_bool());
  EXPECT_FALSE(anchor.at("resumed").as_bool());
  EXPECT_NEAR(anchor.at("transform").at("yaw_deg").to_number<double>(), -137.3, 0.1);
  EXPECT_GE(anchor.at("agreeing").to_number<int>(), 3);
  EXPECT_EQ(anchor.at("agreeing"), anchor.at("found"));
  EXPECT_LT(anchor.at("rms_m").to_number<double>(), 0.05);
  ExpectAt(daemon, "continued", shared_root / "other_lane", 0.05, 0.1);
  EXPECT_EQ(StateOf(daemon, "continued"), "live");
  // Positions are the atlas's, not the drive's: they stay.
  std::optional<KnownPosition> prior;
  const auto read = Connect(daemon).ReadKeyframes({"vehicle", "continued"}, std::nullopt,
                                                  [&](const SessionKeyframe& keyframe) {
                                                    if (keyframe.prior) prior = keyframe.prior;
                                                    return Status();
                                                  });
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(prior,
            (KnownPosition{1'000 * place_mm[0], 1'000 * place_mm[1], 1'000 * place_mm[2], 500}));
}

TEST_F(AnchorTest, WhoseScansAreNotWhereItsPositionsAreStaysOut) {
  const DaemonProcess daemon(NewData(), kSmall);
  Map(daemon, shared_root / "street");
  const std::string before = Digest(daemon);
  const fs::path positions = shared_root / "wrong_positions.txt";
  std::ofstream(positions) << "3 100 100 100 1\n";
  const CommandRun run = Anchor(daemon, shared_root / "moved", {"--positions", positions.string()});
  EXPECT_EQ(run.exit_code, static_cast<int>(ExitCode::kNotFound)) << run.out;
  EXPECT_NE(run.err.find("beside its positions"), std::string::npos) << run.err;
  EXPECT_EQ(StateOf(daemon, "continued"), "staged");
  EXPECT_EQ(Digest(daemon), before);
}

TEST_F(AnchorTest, AnInterruptedOneGoesOnInTheFrameThatItBeganIn) {
  const DaemonProcess daemon(NewData(), kSmall);
  Map(daemon, shared_root / "street");
  const CommandRun first = Anchor(daemon, shared_root / "moved", {"--range", "0:40"});
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const CommandRun second = Anchor(daemon, shared_root / "moved");
  ASSERT_EQ(second.exit_code, 0) << second.err;
  EXPECT_TRUE(AnchorOf(second).at("resumed").as_bool());
  EXPECT_EQ(second.Get<int>("sent_before"), 32);
  EXPECT_EQ(second.Get<int>("duplicates"), 8);
  const DriveFolder drive = OpenDriveFolder(shared_root / "moved").value();
  const auto keyframes = Connect(daemon).ListKeyframes({"vehicle", "continued"});
  EXPECT_EQ(keyframes->size(), drive.scans.size());
  const Pose T_map_drive =
      keyframes->front().T_world_sensor.ToPose() * drive.scans.front().T_world_sensor.inverse();
  for (const KeyframeSummary& keyframe : *keyframes) {
    const Pose expected = T_map_drive * drive.scans.at(keyframe.sequence).T_world_sensor;
    EXPECT_LT((keyframe.T_world_sensor.ToPose().translation() - expected.translation()).norm(),
              2e-5);
  }
  // Another stretch alone, of which nothing was sent yet.
  const CommandRun again = Anchor(daemon, shared_root / "moved", {"--range", "5:9"});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(again.Get<int>("duplicates"), 4);
}

TEST_F(AnchorTest, WhereItIsNotOnTheMapItStaysOutOfIt) {
  const DaemonProcess daemon(NewData(), kSmall);
  Map(daemon, shared_root / "street");
  const std::string before = Digest(daemon);
  for (const bool is_again : {false, true}) {
    const CommandRun run = Anchor(daemon, shared_drive);  // the overpass
    EXPECT_EQ(run.exit_code, static_cast<int>(ExitCode::kNotFound));
    EXPECT_NE(run.err.find("don't know where in the atlas"), std::string::npos) << run.err;
    for (std::size_t part = 0; part < 2; ++part) {
      EXPECT_FALSE(AnchorOf(run, part).at("anchored").as_bool());
      EXPECT_TRUE(AnchorOf(run, part).at("transform").is_null());
      EXPECT_EQ(AnchorOf(run, part).at("resumed").as_bool(), is_again);
    }
    EXPECT_EQ(StateOf(daemon, "continued"), "staged");
    EXPECT_EQ(StateOf(daemon, "continued.2"), "staged");
    EXPECT_EQ(Digest(daemon), before);
    ExpectAt(daemon, "continued", shared_drive, 1e-5, 1e-5);
    EXPECT_EQ(run.Get<int>("duplicates"), is_again ? run.Get<int>("keyframes") : 0);
  }
}

// However far apart the two are in the drive's own frame.
TEST_F(AnchorTest, EachPartBehindAJumpIsFoundForItself) {
  const fs::path parts = shared_root / "parts";
  fs::copy(shared_root / "other_lane", parts, fs::copy_options::recursive);
  const DriveFolder all = OpenDriveFolder(parts).value();
  for (std::size_t i = 40; i < 50; ++i) {
    fs::remove(all.scans[i].scan);
  }
  const fs::path moved = shared_root / "moved_parts";
  WriteMoved(parts, moved, {Far(), {-20.0 * kDegree, {3.0, 400.0, -8.0}}});
  const DaemonProcess daemon(NewData(), kSmall);
  Map(daemon, shared_root / "street");
  const CommandRun run = Anchor(daemon, moved);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NEAR(AnchorOf(run, 0).at("transform").at("yaw_deg").to_number<double>(), -137.3, 0.1);
  EXPECT_NEAR(AnchorOf(run, 1).at("transform").at("yaw_deg").to_number<double>(), 20.0, 0.1);
  ExpectAt(daemon, "continued", shared_root / "other_lane", 0.05, 0.1);
  ExpectAt(daemon, "continued.2", shared_root / "other_lane", 0.05, 0.1);
}

TEST_F(AnchorTest, APriorIsBelieved) {
  const DaemonProcess daemon(NewData(), kSmall);
  Map(daemon, shared_root / "street");
  const Eigen::Vector3d begin =
      OpenDriveFolder(shared_root / "other_lane")->scans.front().T_world_sensor.translation();
  const auto near = [&](double off_m) {
    return std::to_string(begin.x() + off_m) + "," + std::to_string(begin.y());
  };
  const CommandRun wrong =
      Anchor(daemon, shared_root / "moved",
             {"--prior", near(900.0), "--prior-radius", "20", "--session", "wrong"});
  EXPECT_EQ(wrong.exit_code, static_cast<int>(ExitCode::kNotFound)) << wrong.out;
  // Scans of the drive pass there, but it does not begin there.
  const CommandRun beside =
      Anchor(daemon, shared_root / "moved",
             {"--prior", near(30.0), "--prior-radius", "20", "--session", "beside"});
  EXPECT_EQ(beside.exit_code, static_cast<int>(ExitCode::kNotFound)) << beside.out;
  EXPECT_NE(beside.err.find("further from the prior"), std::string::npos) << beside.err;
  EXPECT_EQ(StateOf(daemon, "beside"), "staged");
  const auto within = [&](double off_m) {
    return std::to_string(begin.z() + off_m) + ",1.5";
  };
  const CommandRun too_high = Anchor(daemon, shared_root / "moved",
                                     {"--prior-height", within(6.4), "--session", "too_high"});
  EXPECT_EQ(too_high.exit_code, static_cast<int>(ExitCode::kNotFound)) << too_high.out;
  const CommandRun right =
      Anchor(daemon, shared_root / "moved",
             {"--prior", near(15.0), "--prior-radius", "20", "--prior-height", within(-0.8)});
  ASSERT_EQ(right.exit_code, 0) << right.err;
  ExpectAt(daemon, "continued", shared_root / "other_lane", 0.05, 0.1);
  const CommandRun contradicted =
      Anchor(daemon, shared_root / "moved", {"--prior", near(900.0), "--prior-radius", "20"});
  EXPECT_EQ(contradicted.exit_code, static_cast<int>(ExitCode::kConflict)) << contradicted.out;
  const auto begins = AnchorOf(right).at("begins").as_array();
  EXPECT_NEAR(begins.at(0).to_number<double>(), begin.x(), 0.05);
  EXPECT_NEAR(begins.at(1).to_number<double>(), begin.y(), 0.05);
}

// By 1 % and 0.5 degrees in 100 m, as odometries do.
TEST_F(AnchorTest, ADriveWhosePosesDriftIsForAMerge) {
  DriveWriteOptions drifts;
  drifts.drift.emplace().seed = 11;
  const fs::path drifting = shared_root / "drifting";
  WriteStreet(drifting, 2, drifts);
  const DaemonProcess daemon(NewData(), kSmall);
  Map(daemon, shared_root / "street");
  const std::string before = Digest(daemon);
  const CommandRun bent = Anchor(daemon, drifting, {"--range", "0:30", "--session", "bent"});
  EXPECT_EQ(bent.exit_code, static_cast<int>(ExitCode::kNotFound)) << bent.out;
  EXPECT_NE(bent.err.find("atlas-merge run"), std::string::npos) << bent.err;
  EXPECT_EQ(StateOf(daemon, "bent"), "staged");
  EXPECT_EQ(Digest(daemon), before);
  // A stretch that is short enough lies well; what comes behind it does not.
  ASSERT_EQ(Anchor(daemon, drifting, {"--range", "0:12", "--session", "grows"}).exit_code, 0);
  ASSERT_EQ(StateOf(daemon, "grows"), "live");
  const std::string begun = Digest(daemon);
  for (const std::string range : {":", "60:75"}) {
    const CommandRun rest = Anchor(daemon, drifting, {"--range", range, "--session", "grows"});
    EXPECT_EQ(rest.exit_code, static_cast<int>(ExitCode::kConflict)) << rest.out << rest.err;
    EXPECT_NE(rest.err.find("atlas-merge run"), std::string::npos) << rest.err;
  }
  EXPECT_EQ(Digest(daemon), begun);
  EXPECT_EQ(Connect(daemon).ListKeyframes({"vehicle", "grows"})->size(), 12U);
  // Unless somebody says that it was accepted.
  const CommandRun resumed =
      Anchor(daemon, drifting, {"--range", "0:16", "--session", "grows", "--resume"});
  ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_EQ(Connect(daemon).ListKeyframes({"vehicle", "grows"})->size(), 16U);
}

// However well the rest of it fits: live, that part would double what is there.
TEST_F(AnchorTest, ADriveOfWhichAPartIsOffStaysOut) {
  const DaemonProcess daemon(NewData(), kSmall);
  Map(daemon, shared_root / "street");
  const std::string before = Digest(daemon);
  const std::size_t scans = OpenDriveFolder(shared_root / "other_lane")->scans.size();
  const std::map<std::string, Bend> bends = {
      {"end", {scans - 12, scans, {0.0, 1.5, 0.0}}},
      {"begin", {0, 6, {0.8, 0.8, 0.0}}},
      {"high", {scans / 2, scans / 2 + 12, {0.0, 0.0, 0.6}}},
      {"near", {scans - 12, scans, {0.25, 0.25, 0.0}}},
      {"hovering", {scans / 2, scans / 2 + 8, {0.0, 0.0, 2.2}}},
      {"short", {scans / 2, scans / 2 + 3, {1.2, 1.2, 0.0}}},
      {"rolled", {0, scans, {0.0, 0.0, 0.0}, 1.6}},
  };
  for (const auto& [name, bend] : bends) {
    const fs::path drive = shared_root / ("bent_" + name);
    WriteMoved(shared_root / "other_lane", drive, {Far()}, bend);
    const CommandRun run = Anchor(daemon, drive, {"--session", name});
    EXPECT_EQ(run.exit_code, static_cast<int>(ExitCode::kNotFound)) << name << run.out;
    EXPECT_EQ(StateOf(daemon, name), "staged") << name;
    EXPECT_EQ(Digest(daemon), before) << name;
  }
}

// Scans are matched as keyframes are made of them. These are not skewed, so that it spoils both.
TEST_F(AnchorTest, WhatIsDeskewedIsMatchedDeskewed) {
  const DaemonProcess daemon(NewData(), kSmall);
  Map(daemon, shared_root / "street");
  const auto off_m = [&](const std::string& deskew) {
    const CommandRun run = Anchor(daemon, shared_root / "moved",
                                  {"--staged", "--deskew", deskew, "--session", deskew});
    return AnchorOf(run).at("rms_m").to_number<double>();
  };
  EXPECT_LT(off_m("off"), 0.02);
  EXPECT_LT(off_m("auto"), 0.02);
  EXPECT_GT(off_m("on"), 0.04);
}

// A merge bends it; the daemon would take the next scan for an impossible step.
TEST_F(AnchorTest, ASessionThatWasCorrectedIsNotGoneOnWith) {
  const DaemonProcess daemon(NewData(), kSmall);
  Map(daemon, shared_root / "street");
  const std::vector<std::string> begun = {"--range", "0:40", "--scans", "even"};
  ASSERT_EQ(Anchor(daemon, shared_root / "moved", begun).exit_code, 0);
  AtlasClient client = Connect(daemon);
  const KeyframeSummary last = client.ListKeyframes({"vehicle", "continued"})->back();
  PoseCorrection correction;
  correction.key = {{"vehicle", "continued"}, last.sequence};
  correction.T_world_sensor = last.T_world_sensor;
  correction.T_world_sensor.x_um += 10'000;
  ASSERT_TRUE(client.UpdatePoses(std::vector{correction}, "test"));
  for (const std::string range : {":", "0:38"}) {  // behind it, and in between
    const CommandRun rest = Anchor(daemon, shared_root / "moved", {"--range", range});
    EXPECT_EQ(rest.exit_code, static_cast<int>(ExitCode::kConflict)) << rest.out << rest.err;
    EXPECT_NE(rest.err.find("corrected"), std::string::npos) << rest.err;
  }
  EXPECT_EQ(client.ListKeyframes({"vehicle", "continued"})->size(), 20U);
  const CommandRun nothing_new = Anchor(daemon, shared_root / "moved", begun);
  EXPECT_EQ(nothing_new.exit_code, 0) << nothing_new.err;
}

TEST_F(AnchorTest, WithoutAMapThereIsNothingToFindItIn) {
  const DaemonProcess daemon(NewData(), kSmall);
  const CommandRun run = Anchor(daemon, shared_root / "moved");
  EXPECT_EQ(run.exit_code, static_cast<int>(ExitCode::kNotFound));
  EXPECT_NE(run.err.find("ingested without --anchor"), std::string::npos) << run.err;
  EXPECT_EQ(Connect(daemon).ReadStatus()->keyframes, 0U);
}

TEST_F(AnchorTest, AnotherDriveUnderTheNameIsFoundOut) {
  const DaemonProcess daemon(NewData(), kSmall);
  Map(daemon, shared_root / "street");
  ASSERT_EQ(Anchor(daemon, shared_root / "moved", {"--range", "60:"}).exit_code, 0);
  const std::string before = Digest(daemon);
  const fs::path few = shared_root / "few";
  fs::copy(shared_root / "street", few, fs::copy_options::recursive);
  const DriveFolder all = OpenDriveFolder(few).value();
  for (const DriveScan& scan : all.scans) {
    if (scan.number >= 20) fs::remove(scan.scan);
  }
  const CommandRun without_one = Anchor(daemon, few);
  EXPECT_EQ(without_one.exit_code, static_cast<int>(ExitCode::kConflict)) << without_one.err;
  const CommandRun at_other_times = Anchor(daemon, shared_root / "moved", {"--start", "1000"});
  EXPECT_EQ(at_other_times.exit_code, static_cast<int>(ExitCode::kConflict)) << at_other_times.err;
  const CommandRun same_numbers = Anchor(daemon, shared_root / "street");
  EXPECT_EQ(same_numbers.exit_code, static_cast<int>(ExitCode::kConflict)) << same_numbers.err;
  EXPECT_EQ(Digest(daemon), before);
}

}  // namespace
}  // namespace atlas
