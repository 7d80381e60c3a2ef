#include "client/drive/track_file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <numbers>
#include <string_view>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr std::string_view kColumns =
    "scan,trial,time_s,x_m,y_m,z_m,qx,qy,qz,qw,error_m,error_deg,along_m,across_m,up_m,yaw_deg,"
    "health,fit,sigma_along_m,sigma_across_m,sigma_up_m,sigma_yaw_deg,nees,restart\n";

// With so many digits after the point, whatever the locale.
std::string Fixed(double value, int digits) {
  if (!std::isfinite(value)) return value > 0.0 ? "inf" : "nan";
  std::array<char, 400> text{};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed, digits)
          .ptr;
  return {text.data(), end};
}

class Line {
 public:
  explicit Line(char separator) : separator_(separator) {}

  Line& Add(const std::string& field) {
    if (!is_first_) text_ += separator_;
    is_first_ = false;
    text_ += field;
    return *this;
  }
  Line& Add(double value, int digits = 6) { return Add(Fixed(value, digits)); }
  std::string End() && { return std::move(text_) + '\n'; }

 private:
  char separator_;
  bool is_first_ = true;
  std::string text_;
};

void AddPlace(const Pose& pose, Line& line) {
  const Eigen::Vector3d& place = pose.translation();
  const Eigen::Quaterniond turn(pose.linear());
  line.Add(place.x()).Add(place.y()).Add(place.z());
  line.Add(turn.x(), 9).Add(turn.y(), 9).Add(turn.z(), 9).Add(turn.w(), 9);
}

void AddSigmas(const LocalizedScan& scan, Line& line) {
  constexpr int kSigmas = 4;
  for (int i = 0; i < kSigmas; ++i) {
    if (!scan.covariance) {
      line.Add(std::string());
      continue;
    }
    line.Add(std::sqrt((*scan.covariance)(i, i)) * (i + 1 == kSigmas ? kDegrees : 1.0));
  }
  line.Add(scan.normalized_square ? Fixed(*scan.normalized_square, 4) : std::string());
}

std::string CsvLine(const LocalizedScan& scan) {
  Line line(',');
  line.Add(std::to_string(scan.scan)).Add(std::to_string(scan.trial));
  line.Add(scan.time_s ? Fixed(*scan.time_s, 6) : std::string());
  AddPlace(scan.located.T_world_sensor, line);
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
  Line line(' ');
  line.Add(scan.time_s.value_or(scan.scan));
  AddPlace(scan.located.T_world_sensor, line);
  return std::move(line).End();
}

// A line a scan: where it is lost, where it thought it was.
std::string KittiLine(const LocalizedScan& scan) {
  Line line(' ');
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
