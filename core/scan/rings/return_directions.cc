#include "core/scan/rings/return_directions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/scan/fast_atan2.h"

namespace atlas {
namespace {

// Counts azimuths the way the sensor turns, [0, 2 pi).
void FollowRotation(std::vector<float>& azimuth_rad) {
  int turned = 0;
  for (std::size_t i = 1; i < azimuth_rad.size(); ++i) {
    const float step = azimuth_rad[i] - azimuth_rad[i - 1];
    turned += std::abs(step) < kNeighbours_rad ? (step < 0.0F ? -1 : 1) : 0;
  }
  const float direction = turned < 0 ? -1.0F : 1.0F;
  for (float& angle : azimuth_rad) {
    angle *= direction;
    angle = angle < 0.0F ? angle + 2.0F * std::numbers::pi_v<float> : angle;
  }
}

}  // namespace

ReturnDirections MeasureDirections(const PointCloud& cloud, const EgoBox& ego) {
  ReturnDirections directions;
  directions.azimuth_rad.resize(cloud.size());
  directions.slope.resize(cloud.size());
  directions.index.resize(cloud.size());
  constexpr std::size_t kPiece = 256;
  std::array<float, kPiece> x{};
  std::array<float, kPiece> y{};
  std::array<float, kPiece> z{};
  std::array<float, kPiece> azimuth_rad{};
  std::array<float, kPiece> slope{};
  std::size_t kept = 0;
  for (std::size_t begin = 0; begin < cloud.size(); begin += kPiece) {
    const std::size_t size = std::min(kPiece, cloud.size() - begin);
    for (std::size_t i = 0; i < size; ++i) {
      const Eigen::Vector3f& p = cloud.points[begin + i];
      x[i] = p.x();
      y[i] = p.y();
      z[i] = p.z();
    }
    for (std::size_t i = 0; i < size; ++i) {  // in vectors
      azimuth_rad[i] = FastAtan2(y[i], x[i]);
      slope[i] = z[i] / std::sqrt(x[i] * x[i] + y[i] * y[i]);
    }
    for (std::size_t i = 0; i < size; ++i) {
      directions.azimuth_rad[kept] = azimuth_rad[i];
      directions.slope[kept] = slope[i];
      directions.index[kept] = static_cast<std::uint32_t>(begin + i);
      kept += static_cast<std::size_t>(!ego.Contains(cloud.points[begin + i]));
    }
  }
  directions.azimuth_rad.resize(kept);
  directions.slope.resize(kept);
  directions.index.resize(kept);
  FollowRotation(directions.azimuth_rad);
  return directions;
}

}  // namespace atlas
