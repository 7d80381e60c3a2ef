#include "core/localization/registration/scan_features.h"

#include <algorithm>
#include <array>

#include "core/base/fast_floor.h"

namespace atlas {
namespace {

constexpr float kAnyHeight_m = 1e4F;

// Of a Sum's key, from the lowest: its order, then z, y and x.
constexpr int kOrderBits = 22;
constexpr int kIndexBits = 14;

// At most so many, evenly through the scan.
void Interleave(const std::vector<Eigen::Vector3f>& points,
                std::size_t most,
                std::vector<Eigen::Vector3f>& interleaved) {
  constexpr std::size_t kStride = 4;
  constexpr std::array<std::size_t, kStride> kFirst{0, 2, 1, 3};
  const std::size_t count = std::min(points.size(), most);
  interleaved.clear();
  for (const std::size_t first : kFirst) {
    for (std::size_t i = first; i < count; i += kStride) {
      interleaved.push_back(points[i * points.size() / count]);
    }
  }
}

void TakeEveryOther(const std::vector<Eigen::Vector3f>& points,
                    std::vector<Eigen::Vector3f>& taken) {
  taken.clear();
  for (std::size_t i = 0; i < points.size(); i += 2) {
    taken.push_back(points[i]);
  }
}

}  // namespace

// Of the returns those that come first are from everywhere.
void Thin(const ScanFeatures& scan, ScanFeatures& thinned) {
  TakeEveryOther(scan.columns, thinned.columns);
  TakeEveryOther(scan.ground, thinned.ground);
  const auto few = static_cast<std::ptrdiff_t>(scan.returns.size() / 4);
  thinned.returns.assign(scan.returns.begin(), scan.returns.begin() + few);
}

VoxelAverager::VoxelAverager(float side_m, float height_m)
    : voxels_per_m_(1.0F / side_m, 1.0F / side_m, 1.0F / height_m) {}

// Of a point within a kilometre: from there on all voxels are one.
std::uint64_t VoxelAverager::Voxel(const Eigen::Vector3f& p) const {
  constexpr std::int32_t kMost = (1 << (kIndexBits - 1)) - 1;
  const auto index = [](float v) {
    constexpr auto kBound = static_cast<float>(kMost);
    return static_cast<std::uint64_t>(FastFloor(std::clamp(v, -kBound, kBound)) + kMost);
  };
  const Eigen::Vector3f at = p.cwiseProduct(voxels_per_m_);
  return ((index(at.x()) << (2 * kIndexBits)) | (index(at.y()) << kIndexBits) | index(at.z()))
         << kOrderBits;
}

// Neighbours on a ring often share a voxel: they are a sum before anything is sorted.
void VoxelAverager::Add(const Eigen::Vector3f& p) {
  const std::uint64_t voxel = Voxel(p);
  if (sums_.empty() || sums_.back().voxel >> kOrderBits != voxel >> kOrderBits) {
    constexpr std::size_t kLast = (std::size_t{1} << kOrderBits) - 1;
    sums_.push_back({voxel | std::min(sums_.size(), kLast), Eigen::Vector3f::Zero(), 0.0F});
  }
  sums_.back().sum += p;
  sums_.back().count += 1.0F;
}

void VoxelAverager::Means(std::vector<Eigen::Vector3f>& means) {
  std::sort(sums_.begin(), sums_.end(),
            [](const Sum& a, const Sum& b) { return a.voxel < b.voxel; });
  means.clear();
  for (std::size_t begin = 0; begin < sums_.size();) {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    float count = 0.0F;
    std::size_t end = begin;
    for (; end < sums_.size() && sums_[end].voxel >> kOrderBits == sums_[begin].voxel >> kOrderBits;
         ++end) {
      sum += sums_[end].sum;
      count += sums_[end].count;
    }
    means.emplace_back(sum / count);
    begin = end;
  }
}

FeatureExtractor::FeatureExtractor(const FeatureOptions& options)
    : options_(options),
      columns_(options.column_voxel_m, options.column_height_m),
      ground_(options.ground_voxel_m, kAnyHeight_m) {}

const ScanFeatures& FeatureExtractor::Extract(const LeveledScan& scan) {
  Begin();
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (scan.range_m[i] > options_.max_range_m) {
      continue;
    }
    const Eigen::Vector3f p(scan.x[i], scan.y[i], scan.z[i]);
    if (scan.is_ground[i] != 0) {
      AddGround(p);
    } else {
      AddObstacle(p);
    }
  }
  return Finish();
}

void FeatureExtractor::Begin() {
  columns_.Clear();
  ground_.Clear();
  obstacles_.clear();
}

void FeatureExtractor::AddObstacle(const Eigen::Vector3f& p) {
  columns_.Add(p);
  obstacles_.push_back(p);
}

const ScanFeatures& FeatureExtractor::Finish() {
  columns_.Means(features_.columns);
  ground_.Means(features_.ground);
  Interleave(obstacles_, options_.max_returns, features_.returns);
  return features_;
}

ScanFeatures ExtractFeatures(const LeveledScan& scan, const FeatureOptions& options) {
  return FeatureExtractor(options).Extract(scan);
}

}  // namespace atlas
