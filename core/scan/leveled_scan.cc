#include "core/scan/leveled_scan.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/scan/fast_atan2.h"

namespace atlas {
namespace {

constexpr float kTurn = 2.0F * std::numbers::pi_v<float>;

float ColumnSpacing(const RangeImage& image) {
  std::uint32_t most = 1;
  for (int row = 0; row < image.rows; ++row) {
    for (int sector = 0; sector < RangeImage::kSectors; ++sector) {
      most = std::max(most, image.End(row, sector) - image.Begin(row, sector));
    }
  }
  return kTurn / static_cast<float>(RangeImage::kSectors) / static_cast<float>(most);
}

}  // namespace

LeveledScan LevelScan(const RangeImage& image,
                      std::vector<std::uint8_t> is_ground,
                      const Eigen::Quaternionf& R_level_sensor) {
  const std::size_t size = image.size();
  LeveledScan scan;
  for (std::vector<float>* plane : {&scan.x, &scan.y, &scan.z, &scan.range_m, &scan.azimuth_rad}) {
    plane->resize(size);
  }
  const Eigen::Matrix3f R = R_level_sensor.toRotationMatrix();
  for (std::size_t i = 0; i < size; ++i) {
    const float x = image.x[i];
    const float y = image.y[i];
    const float z = image.z[i];
    scan.x[i] = R(0, 0) * x + R(0, 1) * y + R(0, 2) * z;
    scan.y[i] = R(1, 0) * x + R(1, 1) * y + R(1, 2) * z;
    scan.z[i] = R(2, 0) * x + R(2, 1) * y + R(2, 2) * z;
    scan.range_m[i] = std::sqrt(scan.x[i] * scan.x[i] + scan.y[i] * scan.y[i]);
    const float azimuth = FastAtan2(scan.y[i], scan.x[i]);
    scan.azimuth_rad[i] = azimuth < 0.0F ? azimuth + kTurn : azimuth;
  }
  scan.is_ground = std::move(is_ground);
  scan.column_spacing_rad = ColumnSpacing(image);
  return scan;
}

}  // namespace atlas
