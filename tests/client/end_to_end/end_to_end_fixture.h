// A small simulated drive, written once for all tests of a process, and daemons to feed it to.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "core/simulation/drive_writer.h"
#include "tests/client/end_to_end/command_run.h"
#include "tests/client/end_to_end/daemon_process.h"

namespace atlas {

namespace fs = std::filesystem;

// The overpass, thinly sampled: two roads above each other, a jump between them.
inline void WriteOverpass(const fs::path& folder) {
  DriveOptions options;
  options.sensor = *LidarSensorByName("h350");
  options.spacing_m = 4.0;
  auto world = MakeWorld(*WorldKindByName("overpass"));
  const auto drive = SimulatedDrive::Create(*std::move(world), options);
  ASSERT_TRUE(drive) << drive.error().message();
  const Status status = WriteDrive(*drive, folder, {});
  ASSERT_TRUE(status.ok()) << status.message();
}

// A street of 230 m with a scan every 2.5 m and 0.25 s; other seeds have other noise, and lanes.
inline void WriteStreet(const fs::path& folder,
                        std::uint64_t seed,
                        const DriveWriteOptions& write = {},
                        double revolution_s = 0.0) {
  DriveOptions options;
  options.sensor = *LidarSensorByName("h350");
  options.seed = seed;
  options.spacing_m = 2.5;
  options.revolution_s = revolution_s;
  const auto drive = SimulatedDrive::Create(MakeWorld(*WorldKindByName("street")).value(), options);
  ASSERT_TRUE(drive) << drive.error().message();
  const Status status = WriteDrive(*drive, folder, {}, write);
  ASSERT_TRUE(status.ok()) << status.message();
}

class EndToEndTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    shared_root = fs::path(::testing::TempDir()) / ("atlas_end_to_end." + std::to_string(getpid()));
    fs::remove_all(shared_root);
    fs::create_directories(shared_root);
    WriteOverpass(shared_drive = shared_root / "overpass");
  }
  static void TearDownTestSuite() { fs::remove_all(shared_root); }

  // A data directory that no other test of this run uses.
  static fs::path NewData() { return shared_root / ("data" + std::to_string(++shared_data)); }

  static CommandRun Ingest(const DaemonProcess& daemon, std::vector<std::string> more = {}) {
    std::vector<std::string> arguments = {
        "ingest", shared_drive.string(), "--max-range", "12", "--every", "0"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunAtlas(daemon.address(), arguments);
  }
  static std::string Digest(const DaemonProcess& daemon) {
    const CommandRun run = RunAtlas(daemon.address(), {"digest"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return run.exit_code == 0 ? std::string(run.json().at("digest").as_string()) : "";
  }

  static inline const std::vector<std::string> kSmall = {"--cell-size", "0.2"};
  static inline fs::path shared_root;
  static inline fs::path shared_drive;
  static inline int shared_data = 0;
};

}  // namespace atlas
