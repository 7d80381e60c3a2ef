#include "core/localization/registration/pose_search.h"

#include <algorithm>
#include <cmath>

namespace atlas {
namespace {

struct Candidate {
  int score = 0;
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  double yaw_rad = 0.0;
};

// Evenly over the list, which is in voxel order: all around the sensor.
std::vector<Eigen::Vector3f> Thinned(const std::vector<Eigen::Vector3f>& points,
                                     std::size_t count) {
  if (points.size() <= count) {
    return points;
  }
  std::vector<Eigen::Vector3f> thinned;
  thinned.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    thinned.push_back(points[i * points.size() / count]);
  }
  return thinned;
}

// The best candidates so far, the best first, all apart from each other.
class Shortlist {
 public:
  explicit Shortlist(const PoseSearchOptions& options) : options_(options) {}

  void Offer(const Candidate& candidate) {
    if (best_.size() == options_.candidates && candidate.score <= best_.back().score) {
      return;
    }
    const auto near = std::find_if(best_.begin(), best_.end(), [&](const Candidate& other) {
      return !AreApart(candidate, other);
    });
    if (near != best_.end()) {
      if (near->score >= candidate.score) {
        return;
      }
      best_.erase(near);
    }
    const auto place = std::find_if(best_.begin(), best_.end(), [&](const Candidate& other) {
      return other.score < candidate.score;
    });
    best_.insert(place, candidate);
    if (best_.size() > options_.candidates) {
      best_.pop_back();
    }
  }

  const std::vector<Candidate>& best() const { return best_; }

 private:
  bool AreApart(const Candidate& a, const Candidate& b) const {
    return (a.shift - b.shift).norm() >= options_.apart_m ||
           std::abs(a.yaw_rad - b.yaw_rad) >= options_.apart_rad;
  }

  const PoseSearchOptions& options_;
  std::vector<Candidate> best_;
};

// Calls visit for 0, 1, -1, 2, -2 ... steps up to `reach`: of equals the nearest comes first.
template <typename Visit>
void ForEachStep(double reach, double step, Visit&& visit) {
  const int steps = static_cast<int>(std::floor(reach / step));
  visit(0.0);
  for (int k = 1; k <= steps; ++k) {
    visit(k * step);
    visit(-k * step);
  }
}

}  // namespace

std::vector<Pose> SearchPoses(const CoarseOccupancy& coarse,
                              const Eigen::Vector3d& origin,
                              const ScanFeatures& features,
                              const Pose& T_world_level,
                              const SearchReach& reach,
                              const PoseSearchOptions& options) {
  const std::vector<Eigen::Vector3f> points = Thinned(features.columns, options.max_columns);
  if (points.size() < options.min_columns) {
    return {};
  }
  const Eigen::Vector3f center = (T_world_level.translation() - origin).cast<float>();
  const Eigen::Vector3d along(std::cos(reach.direction_rad), std::sin(reach.direction_rad), 0.0);
  const Eigen::Vector3d beside(-along.y(), along.x(), 0.0);
  Shortlist shortlist(options);
  std::vector<Eigen::Vector3f> turned(points.size());
  ForEachStep(reach.yaw_rad, options.yaw_step_rad, [&](double yaw_rad) {
    const Eigen::Matrix3f R =
        (Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()) * T_world_level.linear())
            .cast<float>();
    std::transform(points.begin(), points.end(), turned.begin(),
                   [&](const Eigen::Vector3f& p) { return R * p + center; });
    ForEachStep(reach.beside_m, options.step_m, [&](double beside_m) {
      ForEachStep(reach.along_m, options.step_m, [&](double along_m) {
        Candidate candidate{0, along_m * along + beside_m * beside, yaw_rad};
        const Eigen::Vector3f shift = candidate.shift.cast<float>();
        for (const Eigen::Vector3f& p : turned) {
          candidate.score += coarse.IsOccupied(p + shift) ? 1 : 0;
        }
        shortlist.Offer(candidate);
      });
    });
  });
  std::vector<Pose> poses;
  for (const Candidate& candidate : shortlist.best()) {
    Pose pose = T_world_level;
    pose.linear() =
        Eigen::AngleAxisd(candidate.yaw_rad, Eigen::Vector3d::UnitZ()) * T_world_level.linear();
    pose.translation() += candidate.shift;
    poses.push_back(pose);
  }
  return poses;
}

}  // namespace atlas
