// Four drives through a small city, each with a drift and a frame of its own, and with positions as
// a GNSS has them: uploaded staged to the real daemon, and merged by `atlas-merge run`.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iomanip>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <unistd.h>

#include "client/cli/commands/merge/merge_commands.h"
#include "client/connection/atlas_client.h"
#include "core/scan/drive_folder.h"
#include "core/scan/position_file.h"
#include "core/simulation/city/city_world.h"
#include "core/simulation/drive_writer.h"
#include "tests/client/end_to_end/command_run.h"
#include "tests/client/end_to_end/daemon_process.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kDrives = 4;

Pose Frame(double x_m, double y_m, double z_m, double yaw_rad) {
  Pose pose = Pose::Identity();
  pose.translation() = Eigen::Vector3d(x_m, y_m, z_m);
  pose.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return pose;
}

// The merged map beside the truth, root mean square over all keyframes, in metres.
struct MapError {
  double in_place_m = 0.0;   // as it is
  double in_itself_m = 0.0;  // laid on the truth as a whole: turned and shifted
  std::size_t keyframes = 0;
};

MapError ErrorOf(const std::vector<Eigen::Vector3d>& is,
                 const std::vector<Eigen::Vector3d>& truth) {
  const auto count = static_cast<Eigen::Index>(is.size());
  Eigen::Matrix3Xd a(3, count);
  Eigen::Matrix3Xd b(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    a.col(i) = is[static_cast<std::size_t>(i)];
    b.col(i) = truth[static_cast<std::size_t>(i)];
  }
  const Eigen::Isometry3d aligned(Eigen::umeyama(a, b, false));
  const double n = static_cast<double>(count);
  return {std::sqrt((a - b).squaredNorm() / n),
          std::sqrt((aligned * a.colwise().homogeneous() - b).squaredNorm() / n), is.size()};
}

class PositionMergeTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    root = fs::path(::testing::TempDir()) / ("position_merge." + std::to_string(getpid()));
    fs::remove_all(root);
    fs::create_directories(root);
    for (std::size_t i = 0; i < kDrives; ++i) WriteDriveOf(i);
    WriteElsewhere();
  }
  static void TearDownTestSuite() { fs::remove_all(root); }

  static fs::path FolderOf(std::size_t drive) { return root / ("drive" + std::to_string(drive)); }

  // Twice around blocks that share a street, in four parts that overlap.
  static void WriteDriveOf(std::size_t number) {
    DriveOptions options;
    options.sensor = *LidarSensorByName("h350");
    options.seed = number;
    const auto drive = DriveCity(CityTour(options), options);
    ASSERT_TRUE(drive) << drive.error().message();
    DriveWriteOptions part;
    part.begin = 100 * number;
    part.end = part.begin + 155;
    part.drift.emplace().seed = 40 + number;
    part.gnss = GnssOptions{.sigma_m = 0.1, .seed = 60 + number};
    const Status status = WriteDrive(*drive, FolderOf(number), {}, part);
    ASSERT_TRUE(status.ok()) << status.message();
    const double k = static_cast<double>(number);
    MovePoses(FolderOf(number), Frame(300.0 + 100.0 * k, -50.0 * k, 4.0, 0.5 + k));
  }
  // Another world, whose positions are in the middle of the city's.
  static void WriteElsewhere() {
    DriveOptions options;
    options.sensor = *LidarSensorByName("h350");
    options.spacing_m = 4.0;
    const auto drive = SimulatedDrive::Create(MakeStreetWorld(), options);
    ASSERT_TRUE(drive) << drive.error().message();
    DriveWriteOptions all;
    all.gnss.emplace();
    ASSERT_TRUE(WriteDrive(*drive, FolderOf(kDrives), {}, all).ok());
  }
  // As odometry that begins anywhere.
  static void MovePoses(const fs::path& folder, const Pose& T_own_world) {
    const DriveFolder drive = OpenDriveFolder(folder).value();
    std::ofstream out(folder / "poses.txt");
    out << std::setprecision(17);
    for (const DriveScan& scan : drive.scans) {
      for (const double number : PoseToRowMajor(T_own_world * scan.T_world_sensor)) {
        out << number << ' ';
      }
      out << '\n';
    }
  }

  // Its positions as `change` makes them; by the number of the scan.
  static fs::path PositionsOf(std::size_t drive,
                              const std::function<void(std::uint32_t, KnownPlace&)>& change) {
    const DriveFolder folder = OpenDriveFolder(FolderOf(drive)).value();
    KnownPlaces places = ReadPositions(FolderOf(drive) / "positions.txt", folder).value();
    for (auto& [number, place] : places) {
      if (change) change(number, place);
    }
    const fs::path path = root / ("positions" + std::to_string(drive) + ".txt");
    std::ofstream(path) << PositionFileText(places);
    return path;
  }

  static void Upload(const DaemonProcess& daemon,
                     std::size_t drive,
                     const std::optional<fs::path>& positions) {
    std::vector<std::string> arguments = {"ingest",    FolderOf(drive).string(),
                                          "--vehicle", "car" + std::to_string(drive),
                                          "--session", "day",
                                          "--staged",  "--every",
                                          "1"};
    if (positions) arguments.insert(arguments.end(), {"--positions", positions->string()});
    const CommandRun run = RunAtlas(daemon.address(), arguments);
    ASSERT_EQ(run.exit_code, 0) << run.err;
  }

  static boost::json::object Merge(const DaemonProcess& daemon) {
    // The same drives again and again: what was found of their submaps is kept.
    const std::vector<std::string> arguments = {"run", "--json", "--work",
                                                (root / "work").string()};
    std::ostringstream out;
    std::ostringstream err;
    const auto commands = MakeMergeCommands();
    const auto code = RunCommandLine(arguments, commands, {out, err, false, daemon.address()});
    EXPECT_EQ(static_cast<int>(code), 0) << err.str();
    return boost::json::parse(out.str()).as_object();
  }
  // Of all four: their sessions come into the map.
  static MapError MergedError(const DaemonProcess& daemon) {
    const boost::json::object report = Merge(daemon);
    for (std::size_t i = 0; i < kDrives; ++i) {
      EXPECT_TRUE(SessionOf(report, i).at("joined").as_bool()) << i;
    }
    return StoredError(daemon);
  }
  static boost::json::object SessionOf(const boost::json::object& report, std::size_t drive) {
    for (const auto& session : report.at("sessions").as_array()) {
      if (session.at("vehicle").as_string() == "car" + std::to_string(drive)) {
        return session.as_object();
      }
    }
    return {};
  }

  static AtlasClient Connect(const DaemonProcess& daemon) {
    ConnectionOptions options;
    options.endpoint = *Endpoint::Parse(daemon.address());
    return AtlasClient::Connect(options).value();
  }
  static MapError StoredError(const DaemonProcess& daemon) {
    AtlasClient client = Connect(daemon);
    std::vector<Eigen::Vector3d> is;
    std::vector<Eigen::Vector3d> truth;
    for (std::size_t i = 0; i < kDrives; ++i) {
      const auto true_poses = ReadPoses(FolderOf(i) / "truth.txt").value();
      const auto stored = client.ListKeyframes({"car" + std::to_string(i), "day"}).value();
      for (const KeyframeSummary& keyframe : stored) {
        is.push_back(keyframe.T_world_sensor.ToPose().translation());
        truth.push_back(true_poses.at(keyframe.sequence).translation());
      }
    }
    return ErrorOf(is, truth);
  }

  static fs::path NewData() { return root / ("data" + std::to_string(++data)); }

  static inline fs::path root;
  static inline int data = 0;
};

TEST_F(PositionMergeTest, TheMapIsWhereItsPositionsAreAndTruerThanWithout) {
  const DaemonProcess without(NewData(), {});
  const DaemonProcess with(NewData(), {});
  for (std::size_t i = 0; i < kDrives; ++i) {
    Upload(without, i, std::nullopt);
    Upload(with, i, FolderOf(i) / "positions.txt");
  }
  Upload(with, kDrives, FolderOf(kDrives) / "positions.txt");
  const MapError plain = MergedError(without);
  const MapError placed = MergedError(with);
  RecordProperty("in_itself_without_m", std::to_string(plain.in_itself_m));
  RecordProperty("in_itself_with_m", std::to_string(placed.in_itself_m));
  EXPECT_GT(plain.in_place_m, 100.0);
  EXPECT_LT(placed.in_place_m, 0.15);
  EXPECT_LT(placed.in_itself_m, plain.in_itself_m);

  // Who meets nobody is not put there by positions alone.
  const boost::json::object again = Merge(with);
  EXPECT_FALSE(again.at("applied").as_bool()) << "it was done";
  const boost::json::object elsewhere = SessionOf(again, kDrives);
  EXPECT_FALSE(elsewhere.at("joined").as_bool());
  EXPECT_NE(std::string(elsewhere.at("why_not").as_string()).find("positions alone"),
            std::string::npos);
}

TEST_F(PositionMergeTest, OneInTwentyThatIsWrongDoesNotHarm) {
  const DaemonProcess daemon(NewData(), {});
  for (std::size_t i = 0; i < kDrives; ++i) {
    Upload(daemon, i, PositionsOf(i, [](std::uint32_t number, KnownPlace& place) {
             if (number % 20 == 7) {
               place.p_world += 20.0 * Eigen::Vector3d(std::sin(number), std::cos(number), 0.0);
             }
           }));
  }
  const MapError error = MergedError(daemon);
  RecordProperty("in_place_m", std::to_string(error.in_place_m));
  EXPECT_LT(error.in_place_m, 0.15);
}

// The map is of two drives, and the third has positions of another frame.
TEST_F(PositionMergeTest, AMapThatStaysIsNotTornByPositions) {
  const DaemonProcess daemon(NewData(), {});
  for (const std::size_t i : {0U, 1U}) Upload(daemon, i, FolderOf(i) / "positions.txt");
  Merge(daemon);
  AtlasClient client = Connect(daemon);
  const auto before = client.ListKeyframes({"car0", "day"}).value();
  Upload(daemon, 2, PositionsOf(2, [](std::uint32_t, KnownPlace& place) {
           place.p_world += Eigen::Vector3d(30.0, -40.0, 5.0);
         }));
  const boost::json::object report = Merge(daemon);
  EXPECT_TRUE(SessionOf(report, 0).at("held").as_bool());
  EXPECT_TRUE(SessionOf(report, 2).at("joined").as_bool());
  const boost::json::object positions = SessionOf(report, 2).at("positions").as_object();
  EXPECT_FALSE(positions.at("used").as_bool());
  EXPECT_NE(std::string(positions.at("why_not").as_string()).find("the map, which stays"),
            std::string::npos)
      << positions;
  const auto after = client.ListKeyframes({"car0", "day"}).value();
  ASSERT_EQ(after.size(), before.size());
  for (std::size_t i = 0; i < after.size(); ++i) {
    EXPECT_EQ(after[i].T_world_sensor, before[i].T_world_sensor);
  }
  const auto true_poses = ReadPoses(FolderOf(2) / "truth.txt").value();
  const auto third = client.ListKeyframes({"car2", "day"}).value();
  for (const KeyframeSummary& keyframe : third) {
    const Eigen::Vector3d truth = true_poses.at(keyframe.sequence).translation();
    EXPECT_LT((keyframe.T_world_sensor.ToPose().translation() - truth).norm(), 0.5)
        << keyframe.sequence;
  }
}

}  // namespace
}  // namespace atlas
