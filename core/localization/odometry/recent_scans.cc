#include "core/localization/odometry/recent_scans.h"

#include <algorithm>

namespace atlas {
namespace {

void Append(const std::vector<Eigen::Vector3f>& points,
            const Pose& T_origin_level,
            std::vector<Eigen::Vector3f>& all) {
  const Eigen::Matrix3f R = T_origin_level.linear().cast<float>();
  const Eigen::Vector3f t = T_origin_level.translation().cast<float>();
  for (const Eigen::Vector3f& p : points) all.push_back(R * p + t);
}

Pose From(const Eigen::Vector3d& origin, Pose T_world_level) {
  T_world_level.translation() -= origin;
  return T_world_level;
}

}  // namespace

void RecentScans::Add(const ScanFeatures& features, const Pose& T_world_level) {
  if (count_ == 0) next_ = 0;
  if (scans_.size() < most_) {
    scans_.resize(most_);
    for (Scan& scan : scans_) {  // room for more than this: scans that follow allocate nothing
      scan.columns.reserve(2 * features.columns.size());
      scan.ground.reserve(2 * features.ground.size());
    }
  }
  Scan& scan = scans_[next_];
  scan.T_world_level = T_world_level;
  scan.columns.assign(features.columns.begin(), features.columns.end());
  scan.ground.assign(features.ground.begin(), features.ground.end());
  next_ = (next_ + 1) % most_;
  count_ = std::min(count_ + 1, most_);
}

std::vector<Eigen::Vector3f> RecentScans::Columns(const Eigen::Vector3d& origin) const {
  std::vector<Eigen::Vector3f> all;
  for (std::size_t i = 0; i < count_; ++i) {
    Append(scans_[i].columns, From(origin, scans_[i].T_world_level), all);
  }
  return all;
}

std::vector<Eigen::Vector3f> RecentScans::Ground(const Eigen::Vector3d& origin) const {
  std::vector<Eigen::Vector3f> all;
  for (std::size_t i = 0; i < count_; ++i) {
    Append(scans_[i].ground, From(origin, scans_[i].T_world_level), all);
  }
  return all;
}

}  // namespace atlas
