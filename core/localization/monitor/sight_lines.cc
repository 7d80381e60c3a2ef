#include "core/localization/monitor/sight_lines.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/scan/fast_atan2.h"

namespace atlas {
namespace {

constexpr float kHalfTurn = std::numbers::pi_v<float>;

}  // namespace

SightLines::SightLines(const SightOptions& options, float cell_size_m, float segment_height_m)
    : options_(options), cell_size_m_(cell_size_m), halves_per_m_(2.0F / segment_height_m) {}

void SightLines::Assign(const LeveledScan& scan, const Pose& T_world_level) {
  sectors_.Assign(scan, options_.min_range_m);
  T_world_level_ = T_world_level;
  const Eigen::Matrix3f R = T_world_level.linear().cast<float>();
  R_level_world_ = R.topLeftCorner<2, 2>().transpose();
  tilt_ = R.col(2).head<2>();
}

HalvesSeen SightLines::Look(const Eigen::Vector2f& offset, const Heights& heights) const {
  HalvesSeen seen;
  const float range2 = offset.squaredNorm();
  if (range2 < options_.min_range_m * options_.min_range_m ||
      range2 > options_.max_range_m * options_.max_range_m) {
    return seen;
  }
  const float range_m = std::sqrt(range2);
  const float along_m = options_.along_m + options_.along_per_m * range_m;
  const float beside_m = options_.beside_m + options_.beside_per_m * range_m;
  const Eigen::Vector2f level = R_level_world_ * offset;
  const float signed_rad = FastAtan2(level.y(), level.x());
  const float azimuth_rad = signed_rad < 0.0F ? signed_rad + 2.0F * kHalfTurn : signed_rad;
  const float inner_rad = 0.5F * cell_size_m_ / range_m;
  const float outer_rad = inner_rad + beside_m / range_m;
  // Of the plane through the sensor that is level for the scan, there.
  const float leaning_m = tilt_.dot(offset);
  const auto halves = static_cast<float>(2 * heights.segments);
  const float top_m = heights.bottom_m + halves / halves_per_m_;
  const ScanSectors::Window window{
      azimuth_rad, outer_rad, (std::max(heights.bottom_m, heights.foot_m) + leaning_m) / range_m,
      (top_m + leaning_m) / range_m, range_m - along_m};
  sectors_.ForEach(window, [&](const ScanSectors::Return& r, float angle_rad) {
    const float height_m = r.slope * range_m - leaning_m;
    const float half = std::floor((height_m - heights.bottom_m) * halves_per_m_);
    if (half < 0.0F || half >= halves) {
      return;
    }
    const std::uint32_t bit = std::uint32_t{1} << static_cast<int>(half);
    const float behind_m = r.range_m - range_m;
    if (behind_m > along_m) {
      seen.passed |= angle_rad <= inner_rad ? bit : 0;
    } else if (behind_m < -along_m || r.is_ground) {
      seen.blocked |= bit;
    } else {
      seen.hit |= bit;
    }
  });
  return seen;
}

}  // namespace atlas
