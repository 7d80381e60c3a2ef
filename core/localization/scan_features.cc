#include "core/localization/scan_features.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace atlas {
namespace {

// Averages points that share a voxel; voxels in a fixed order.
class VoxelAverager {
 public:
  VoxelAverager(float side_m, float height_m) : side_m_(side_m), height_m_(height_m) {}

  void Add(const Eigen::Vector3f& p) { points_.emplace_back(Voxel(p), p); }

  std::vector<Eigen::Vector3f> Means() {
    std::stable_sort(points_.begin(), points_.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<Eigen::Vector3f> means;
    for (std::size_t begin = 0; begin < points_.size();) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      std::size_t end = begin;
      for (; end < points_.size() && points_[end].first == points_[begin].first; ++end) {
        sum += points_[end].second;
      }
      means.emplace_back(sum / static_cast<float>(end - begin));
      begin = end;
    }
    return means;
  }

 private:
  std::uint64_t Voxel(const Eigen::Vector3f& p) const {
    constexpr float kOffset = 1 << 20;
    const auto index = [](float v) {
      return static_cast<std::uint64_t>(std::floor(v) + kOffset);
    };
    return (index(p.x() / side_m_) << 42) | (index(p.y() / side_m_) << 21) |
           index(p.z() / height_m_);
  }

  float side_m_;
  float height_m_;
  std::vector<std::pair<std::uint64_t, Eigen::Vector3f>> points_;
};

// Evenly through the scan.
std::vector<Eigen::Vector3f> Thinned(std::vector<Eigen::Vector3f> points, std::size_t most) {
  if (points.size() <= most) {
    return points;
  }
  for (std::size_t i = 0; i < most; ++i) {
    points[i] = points[i * points.size() / most];
  }
  points.resize(most);
  return points;
}

}  // namespace

ScanFeatures ExtractFeatures(const LeveledScan& scan, const FeatureOptions& options) {
  constexpr float kAnyHeight_m = 1e4F;
  VoxelAverager columns(options.column_voxel_m, options.column_height_m);
  VoxelAverager ground(options.ground_voxel_m, kAnyHeight_m);
  std::vector<Eigen::Vector3f> returns;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (scan.range_m[i] > options.max_range_m) {
      continue;
    }
    const Eigen::Vector3f p(scan.x[i], scan.y[i], scan.z[i]);
    if (scan.is_ground[i] != 0) {
      ground.Add(p);
    } else {
      columns.Add(p);
      returns.push_back(p);
    }
  }
  return {columns.Means(), ground.Means(), Thinned(std::move(returns), options.max_returns)};
}

}  // namespace atlas
