#include "client/merge/plan/pose_correction.h"

#include <cmath>
#include <cstddef>

namespace atlas {
namespace {

// Driven until each keyframe.
std::vector<double> WayOf(const std::vector<MergeKeyframe>& keyframes) {
  std::vector<double> way_m;
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const double step_m = i == 0 ? 0.0
                                 : (keyframes[i].T_world_sensor.ToPose().translation() -
                                    keyframes[i - 1].T_world_sensor.ToPose().translation())
                                       .norm();
    way_m.push_back(i == 0 ? 0.0 : way_m.back() + step_m);
  }
  return way_m;
}

// A submap that a keyframe moves with, and how much.
struct Share {
  std::size_t submap = 0;
  double weight = 1.0;
};

// How much of which submaps' motions is a keyframe's; all weights of one together are 1.
class MotionShares {
 public:
  explicit MotionShares(const MergeSession& session)
      : submaps_(session.submaps), way_m_(WayOf(session.keyframes)) {}

  std::vector<Share> Of(std::size_t keyframe, std::size_t submap) const {
    const double at_m = way_m_[keyframe];
    const std::size_t middle = submaps_[submap].middle();
    if (keyframe == middle) return {{submap}};
    const bool is_before = keyframe < middle;
    const bool has_other = is_before ? IsJoined(submap) : IsJoined(submap + 1);
    if (has_other) return Between(is_before ? submap - 1 : submap, submap, at_m);
    const bool has_inner = is_before ? IsJoined(submap + 1) : IsJoined(submap);
    return has_inner ? Beyond(submap, is_before ? submap + 1 : submap - 1, at_m)
                     : std::vector<Share>{{submap}};
  }

 private:
  // Whether odometry leads to it from the one before.
  bool IsJoined(std::size_t submap) const {
    return submap > 0 && submap < submaps_.size() && !submaps_[submap].cut.follows_jump;
  }
  double MiddleOf(std::size_t submap) const { return way_m_[submaps_[submap].middle()]; }

  // Between `first` and the next by Lagrange's polynomial through both and those beside them that
  // are about as far away. `own` alone where the vehicle stood.
  std::vector<Share> Between(std::size_t first, std::size_t own, double at_m) const {
    const double step_m = MiddleOf(first + 1) - MiddleOf(first);
    if (step_m == 0.0) return {{own}};
    std::vector<Share> shares{{first}, {first + 1}};
    const auto is_alike = [step_m](double other_m) {
      return other_m >= 0.5 * step_m && other_m <= 2.0 * step_m;
    };
    if (IsJoined(first) && is_alike(MiddleOf(first) - MiddleOf(first - 1))) {
      shares.push_back({first - 1});
    }
    if (IsJoined(first + 2) && is_alike(MiddleOf(first + 2) - MiddleOf(first + 1))) {
      shares.push_back({first + 2});
    }
    for (Share& share : shares) {
      const double here_m = MiddleOf(share.submap);
      for (const Share& other : shares) {
        if (other.submap == share.submap) continue;
        const double there_m = MiddleOf(other.submap);
        share.weight *= (at_m - there_m) / (here_m - there_m);
      }
    }
    return shares;
  }

  // Beyond the last one, `end`, as it went on from the one before it.
  std::vector<Share> Beyond(std::size_t end, std::size_t inner, double at_m) const {
    constexpr double kFarthest = 0.75;  // of the way between the two
    const double beyond_m = std::abs(at_m - MiddleOf(end));
    const double step_m = std::abs(MiddleOf(end) - MiddleOf(inner));
    if (beyond_m > kFarthest * step_m || step_m == 0.0) return {{end}};
    const double share = beyond_m / step_m;
    return {{end, 1.0 + share}, {inner, -share}};
  }

  const std::vector<MergeSubmap>& submaps_;
  std::vector<double> way_m_;
};

// Of several answers that hardly differ; weights together are 1.
class PoseMean {
 public:
  void Add(const Pose& pose, double weight) {
    if (!has_first_) R_first_ = pose.linear();
    has_first_ = true;
    translation_ += weight * pose.translation();
    const Eigen::AngleAxisd turn(R_first_.transpose() * pose.linear());
    turn_ += weight * turn.angle() * turn.axis();
  }
  Pose Mean() const {
    Pose mean = Pose::Identity();
    mean.translation() = translation_;
    const double angle_rad = turn_.norm();
    mean.linear() = R_first_;
    if (angle_rad > 0.0) {
      mean.linear() = R_first_ * Eigen::AngleAxisd(angle_rad, turn_ / angle_rad).toRotationMatrix();
    }
    return mean;
  }

 private:
  bool has_first_ = false;
  Eigen::Matrix3d R_first_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d turn_ = Eigen::Vector3d::Zero();  // from the first, rotation vector
};

}  // namespace

std::vector<Pose> CorrectedPoses(const MergeSession& session,
                                 std::span<const Pose> T_world_submap) {
  const std::vector<MergeSubmap>& submaps = session.submaps;
  const MotionShares shares(session);
  std::vector<Pose> poses(session.keyframes.size());
  for (std::size_t submap = 0; submap < submaps.size(); ++submap) {
    const SubmapCut& cut = submaps[submap].cut;
    for (std::size_t i = cut.begin; i < cut.end; ++i) {
      PoseMean mean;
      for (const Share& share : shares.Of(i, submap)) {
        const Pose T_submap_sensor =
            submaps[share.submap].T_world_submap.inverse() * session.T_world_sensor[i];
        mean.Add(T_world_submap[share.submap] * T_submap_sensor, share.weight);
      }
      poses[i] = mean.Mean();
    }
  }
  return poses;
}

}  // namespace atlas
