#include "core/localization/scan_features.h"

#include <algorithm>
#include <array>
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

// At most so many, evenly through the scan.
std::vector<Eigen::Vector3f> Interleaved(const std::vector<Eigen::Vector3f>& points,
                                         std::size_t most) {
  constexpr std::size_t kStride = 4;
  constexpr std::array<std::size_t, kStride> kFirst{0, 2, 1, 3};
  const std::size_t count = std::min(points.size(), most);
  std::vector<Eigen::Vector3f> interleaved;
  interleaved.reserve(count);
  for (const std::size_t first : kFirst) {
    for (std::size_t i = first; i < count; i += kStride) {
      interleaved.push_back(points[i * points.size() / count]);
    }
  }
  return interleaved;
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
  return {columns.Means(), ground.Means(), Interleaved(returns, options.max_returns)};
}

}  // namespace atlas
