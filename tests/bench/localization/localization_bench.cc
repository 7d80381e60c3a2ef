// Single shots on a recorded drive by the product, the paper's method and ICP on raw returns, in
// one run: a line of JSON a shot, and one about the map. The even scans are the map, the odd ones
// are localized. Columns are 8 m high, however many segments that is.
//
// Usage: localization_bench DRIVE RINGS CELL_M RANGE_M SEGMENTS TRIALS MODE[,MODE...]
#include <array>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <numbers>
#include <sstream>
#include <string>

#include "client/drive/drive_localization.h"
#include "tests/bench/localization/fused_drive.h"
#include "tests/bench/localization/raw_icp.h"

namespace atlas::testing {
namespace {

constexpr double kColumn_m = 8.0;
constexpr double kStart_m = 0.4;
constexpr double kStart_rad = 1.5 * std::numbers::pi / 180.0;

struct Setting {
  std::string drive;
  std::uint32_t rings = 16;
  double cell_m = 0.2;
  double range_m = 40.0;
  int segments = 8;
  std::uint32_t trials = 20;
  std::string modes;
};

MapProfile ProfileOf(const Setting& setting) {
  MapProfile profile;
  profile.cell_size_um = static_cast<std::uint32_t>(std::lround(setting.cell_m * 1e6));
  profile.column_segments = static_cast<std::uint8_t>(setting.segments);
  profile.segment_height_mm =
      static_cast<std::uint16_t>(std::lround(kColumn_m * 1e3 / setting.segments));
  return profile;
}

void PrintShot(const std::string& mode, const LocalizedScan& shot) {
  const PoseOffset& off = shot.offset;
  std::cout << "{\"mode\": \"" << mode << "\", \"scan\": " << shot.scan
            << ", \"trial\": " << shot.trial << ", \"error_m\": " << shot.error.translation_m
            << ", \"error_deg\": " << shot.error.rotation_deg << ", \"offset\": [" << off.along_m
            << ", " << off.left_m << ", " << off.up_m << ", " << off.yaw_rad << "], \"health\": \""
            << LocalizationHealthName(shot.located.health)
            << "\", \"failed\": " << (shot.is_failure ? "true" : "false")
            << ", \"cpu_ms\": " << shot.cpu_s * 1e3;
  if (shot.normalized_square) {
    std::cout << ", \"nees\": " << *shot.normalized_square << ", \"sigma\": ["
              << std::sqrt((*shot.covariance)(0, 0)) << ", " << std::sqrt((*shot.covariance)(1, 1))
              << ", " << std::sqrt((*shot.covariance)(2, 2)) << ", "
              << std::sqrt((*shot.covariance)(3, 3)) << "]";
  }
  std::cout << "}\n";
}

class Bench {
 public:
  explicit Bench(const Setting& setting) : setting_(setting) {
    options_.rings = setting.rings;
    options_.max_range_m = setting.range_m;
    options_.selection.parity = ScanParity::kOdd;
    options_.shots = {kStart_m, kStart_rad, setting.trials};
  }

  Status Run() {
    const auto drive = OpenDriveFolder(setting_.drive);
    if (!drive) return drive.error();
    SurveyOptions survey_options;
    survey_options.rings = setting_.rings;
    const auto survey = SurveyDrive(*drive, survey_options);
    if (!survey) return survey.error();
    auto map = FusedDrive::Fuse(*drive, *survey, {ProfileOf(setting_), even_, setting_.range_m});
    if (!map) return map.error();
    std::cout << "{\"map_bytes\": " << map->blob_bytes() << "}\n";
    std::istringstream modes(setting_.modes);
    for (std::string mode; std::getline(modes, mode, ',');) {
      ATLAS_RETURN_IF_ERROR(Shoot(mode, *drive, *survey, *map));
    }
    return {};
  }

 private:
  Status Shoot(const std::string& mode,
               const DriveFolder& drive,
               const DriveSurvey& survey,
               MapSource& map) {
    const auto print = [&mode](const LocalizedScan& shot) {
      PrintShot(mode, shot);
    };
    if (mode == "raw") {
      RawIcpOptions raw;
      raw.max_range_m = static_cast<float>(setting_.range_m);
      const auto icp = RawIcp::Make(drive, survey, even_, raw);
      if (!icp) return icp.error();
      const auto report = LocalizeDrive(drive, options_, **icp, print);
      return report ? Status() : report.error();
    }
    if (mode != "atlas" && mode != "paper") {
      return {StatusCode::kInvalidArgument, "mode " + mode + ": expected atlas, paper or raw"};
    }
    MapView view(map);
    options_.mode = mode == "paper" ? LocalizationMode::kPaper : LocalizationMode::kAtlas;
    const auto report = LocalizeDrive(drive, options_, view, print);
    return report ? Status() : report.error();
  }

  Setting setting_;
  SelectionOptions even_{.parity = ScanParity::kEven};
  DriveLocalizationOptions options_;
};

}  // namespace
}  // namespace atlas::testing

int main(int argc, char** argv) {
  if (argc != 8) {
    std::cerr << "usage: localization_bench DRIVE RINGS CELL_M RANGE_M SEGMENTS TRIALS MODES\n";
    return 2;
  }
  const std::array<double, 5> numbers{std::atof(argv[2]), std::atof(argv[3]), std::atof(argv[4]),
                                      std::atof(argv[5]), std::atof(argv[6])};
  const atlas::Status status =
      atlas::testing::Bench({argv[1], static_cast<std::uint32_t>(numbers[0]), numbers[1],
                             numbers[2], static_cast<int>(numbers[3]),
                             static_cast<std::uint32_t>(numbers[4]), argv[7]})
          .Run();
  if (!status.ok()) std::cerr << "localization_bench: " << status.message() << '\n';
  return status.ok() ? 0 : 1;
}
