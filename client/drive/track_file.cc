#include "client/drive/track_file.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>
#include <string_view>

#include "client/drive/track_line.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr std::string_view kColumns =
    "scan,trial,time_s,x_m,y_m,z_m,qx,qy,qz,qw,error_m,error_deg,along_m,across_m,up_m,yaw_deg,"
    "health,fit,sigma_along_m,sigma_across_m,sigma_up_m,sigma_yaw_deg,nees,restart\n";

void AddSigmas(const LocalizedScan& scan, TrackLine& line) {
  constexpr int kSigmas = 4;
  for (int i = 0; i < kSigmas; ++i) {
    if (!scan.covariance) {
      line.Add(std::string());
      continue;
    }
    line.Add(std::sqrt((*scan.covariance)(i, i)) * (i + 1 == kSigmas ? kDegrees : 1.0));
  }
  line.Add(scan.normalized_square ? FixedNumber(*scan.normalized_square, 4) : std::string());
}

std::string CsvLine(const LocalizedScan& scan) {
  TrackLine line(',');
  line.Add(std::to_string(scan.scan)).Add(std::to_string(scan.trial));
  line.Add(scan.time_s ? FixedNumber(*scan.time_s, 6) : std::string());
  line.Add(scan.located.T_world_sensor);
  line.Add(scan.error.translation_m).Add(scan.error.rotation_deg);
  line.Add(scan.offset.along_m).Add(scan.offset.left_m).Add(scan.offset.up_m);
  line.Add(scan.offset.yaw_rad * kDegrees);
  line.Add(std::string(LocalizationHealthName(scan.located.health))).Add(scan.located.fit, 4);
  AddSigmas(scan, line);
  return std::move(line.Add(std::string(scan.is_after_jump ? "1" : "0"))).End();
}

// Where it is lost it is nowhere, and the times of the others say so.
std::string TumLine(const LocalizedScan& scan) {
  if (scan.located.health == LocalizationHealth::kLost) return {};
  TrackLine line(' ');
  line.Add(scan.time_s.value_or(scan.scan));
  line.Add(scan.located.T_world_sensor);
  return std::move(line).End();
}

// A line a scan: where it is lost, where it thought it was.
std::string KittiLine(const LocalizedScan& scan) {
  TrackLine line(' ');
  for (const double number : PoseToRowMajor(scan.located.T_world_sensor)) {
    line.Add(number, 9);
  }
  return std::move(line).End();
}

}  // namespace

Result<TrackFormat> TrackFormatOf(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (ending == ".csv") return TrackFormat::kCsv;
  if (ending == ".tum") return TrackFormat::kTum;
  if (ending == ".kitti") return TrackFormat::kKitti;
  return Error(StatusCode::kInvalidArgument,
               StrCat(path.string(), ": expected a name that ends in .csv, .tum or .kitti"));
}

std::string TrackText(TrackFormat format, std::span<const LocalizedScan> scans) {
  std::string text(format == TrackFormat::kCsv ? kColumns : std::string_view());
  for (const LocalizedScan& scan : scans) {
    switch (format) {
      case TrackFormat::kCsv:
        text += CsvLine(scan);
        break;
      case TrackFormat::kTum:
        text += TumLine(scan);
        break;
      case TrackFormat::kKitti:
        text += KittiLine(scan);
        break;
    }
  }
  return text;
}

}  // namespace atlas
