#include "client/drive/relocalization_file.h"

#include <numbers>
#include <string_view>
#include <utility>

#include "client/drive/track_line.h"

namespace atlas {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr std::string_view kColumns =
    "scan,time_s,x_m,y_m,z_m,qx,qy,qz,qw,error_m,error_deg,along_m,across_m,up_m,yaw_deg,health,"
    "fit,explained,margin,places\n";
constexpr int kPoseFields = 7;
constexpr int kErrorFields = 6;

void AddErrors(const RelocalizedScan& scan, TrackLine& line) {
  if (scan.found.places.empty()) {
    line.AddEmpty(kErrorFields);
    return;
  }
  line.Add(scan.error.translation_m).Add(scan.error.rotation_deg);
  line.Add(scan.offset.along_m).Add(scan.offset.left_m).Add(scan.offset.up_m);
  line.Add(scan.offset.yaw_rad * kDegrees);
}

std::string CsvLine(const RelocalizedScan& scan) {
  const Relocalization& found = scan.found;
  TrackLine line(',');
  line.Add(std::to_string(scan.scan));
  line.Add(scan.time_s ? FixedNumber(*scan.time_s, 6) : std::string());
  if (found.T_world_sensor) {
    line.Add(*found.T_world_sensor);
  } else {
    line.AddEmpty(kPoseFields);
  }
  AddErrors(scan, line);
  line.Add(std::string(found.T_world_sensor ? "good" : "lost"));
  if (found.places.empty()) {
    line.AddEmpty(2);
  } else {
    line.Add(found.places.front().registration.fit, 4).Add(found.places.front().explained, 4);
  }
  return std::move(line.Add(found.margin, 4).Add(std::to_string(found.places.size()))).End();
}

}  // namespace

std::string RelocalizationText(std::span<const RelocalizedScan> scans) {
  std::string text(kColumns);
  for (const RelocalizedScan& scan : scans) {
    text += CsvLine(scan);
  }
  return text;
}

}  // namespace atlas
