// `atlas ingest --positions` with the real daemon.
#include <algorithm>
#include <fstream>

#include "core/scan/position_file.h"
#include "tests/client/end_to_end/vehicle_fixture.h"

namespace atlas {
namespace {

class PositionsTest : public VehicleTest {
 protected:
  // Of every other scan.
  static fs::path WritePositions(const std::string& name) {
    KnownPlaces places;
    const DriveFolder drive = OpenDriveFolder(shared_drive).value();
    for (const DriveScan& scan : drive.scans) {
      if (scan.number % 2 == 0) {
        places[scan.number] = {{scan.number + 0.25, -1e6, 3.5}, 0.5};
      }
    }
    const fs::path path = shared_root / name;
    std::ofstream(path) << PositionFileText(places);
    return path;
  }
  static std::vector<SessionKeyframe> Read(const DaemonProcess& daemon,
                                           const std::string& session) {
    std::vector<SessionKeyframe> keyframes;
    AtlasClient client = Connect(daemon);
    const auto reading = client.ReadKeyframes({"vehicle", session}, std::nullopt, [&](auto one) {
      keyframes.push_back(std::move(one));
      return Status();
    });
    EXPECT_TRUE(reading) << reading.error().message();
    return keyframes;
  }
  static void ExpectPositions(const std::vector<SessionKeyframe>& keyframes) {
    for (const SessionKeyframe& keyframe : keyframes) {
      EXPECT_EQ(keyframe.prior.has_value(), keyframe.sequence % 2 == 0) << keyframe.sequence;
      if (!keyframe.prior) continue;
      EXPECT_EQ(*keyframe.prior,
                (KnownPosition{1'000'000 * std::int64_t{keyframe.sequence} + 250'000,
                               -1'000'000'000'000, 3'500'000, 500}));
    }
  }
};

TEST_F(PositionsTest, GoAlongWithTheirKeyframesAlsoOfARunThatGoesOn) {
  const DaemonProcess daemon(NewData(), kSmall);
  const std::string positions = WritePositions("positions.txt").string();
  const CommandRun begun =
      Ingest(daemon, {"--staged", "--range", "0:11", "--positions", positions});
  ASSERT_EQ(begun.exit_code, 0) << begun.err;
  EXPECT_EQ(begun.Get<int>("positions"), 6);
  EXPECT_EQ(begun.err.find("came with"), std::string::npos) << begun.err;
  const CommandRun rest = Ingest(daemon, {"--staged", "--positions", positions});
  ASSERT_EQ(rest.exit_code, 0) << rest.err;
  EXPECT_EQ(rest.Get<int>("sent_before"), 3);
  EXPECT_NE(rest.err.find("keep the positions that they came with"), std::string::npos);
  const std::vector<SessionKeyframe> keyframes = Read(daemon, "overpass");
  ASSERT_GT(keyframes.size(), 20U);
  ExpectPositions(keyframes);
}

TEST_F(PositionsTest, TheMapIsTheSameWithAndWithout) {
  const DaemonProcess with(NewData(), kSmall);
  const DaemonProcess without(NewData(), kSmall);
  ASSERT_EQ(Ingest(with, {"--positions", WritePositions("more.txt").string()}).exit_code, 0);
  const CommandRun plain = Ingest(without);
  ASSERT_EQ(plain.exit_code, 0);
  EXPECT_FALSE(plain.json().as_object().contains("positions"));
  EXPECT_EQ(Digest(with), Digest(without));
}

TEST_F(PositionsTest, WhatCameFirstStays) {
  const DaemonProcess daemon(NewData(), kSmall);
  ASSERT_EQ(Ingest(daemon, {"--range", "0:6"}).exit_code, 0);
  const std::string positions = WritePositions("late.txt").string();
  const CommandRun again = Ingest(daemon, {"--range", "0:6", "--positions", positions});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(again.Get<int>("duplicates"), 6);
  EXPECT_NE(again.err.find("keep the positions that they came with"), std::string::npos)
      << again.err;
  for (const SessionKeyframe& keyframe : Read(daemon, "overpass")) {
    EXPECT_EQ(keyframe.prior, std::nullopt);
  }
}

TEST_F(PositionsTest, AFileThatIsNoneStopsItBeforeTheFirstKeyframe) {
  const DaemonProcess daemon(NewData(), kSmall);
  const fs::path path = WritePositions("spoiled.txt");
  std::ofstream(path, std::ios::app) << "1 0 0 0 -0.5\n";
  const CommandRun run = Ingest(daemon, {"--positions", path.string()});
  EXPECT_EQ(run.exit_code, 6) << run.err;
  EXPECT_NE(run.err.find("spoiled.txt: line "), std::string::npos) << run.err;
  EXPECT_NE(run.err.find("radius -0.5 m"), std::string::npos) << run.err;
  EXPECT_EQ(Connect(daemon).ReadStatus()->keyframes, 0U);
}

}  // namespace
}  // namespace atlas
