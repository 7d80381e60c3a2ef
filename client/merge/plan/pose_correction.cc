#include "client/merge/plan/pose_correction.h"

#include <cstddef>

namespace atlas {
namespace {

Pose Blend(const Pose& a, const Pose& b, double share_of_b) {
  Pose pose = Pose::Identity();
  pose.translation() = (1.0 - share_of_b) * a.translation() + share_of_b * b.translation();
  pose.linear() = Eigen::Quaterniond(a.linear())
                      .slerp(share_of_b, Eigen::Quaterniond(b.linear()))
                      .toRotationMatrix();
  return pose;
}

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

}  // namespace

std::vector<Pose> CorrectedPoses(const MergeSession& session,
                                 std::span<const Pose> T_world_submap) {
  const std::vector<MergeSubmap>& submaps = session.submaps;
  const std::vector<double> way_m = WayOf(session.keyframes);
  const auto moved_with = [&](std::size_t submap, std::size_t keyframe) -> Pose {
    return T_world_submap[submap] *
           (submaps[submap].T_world_submap.inverse() * session.T_world_sensor[keyframe]);
  };
  std::vector<Pose> poses(session.keyframes.size());
  for (std::size_t submap = 0; submap < submaps.size(); ++submap) {
    const SubmapCut& cut = submaps[submap].cut;
    const std::size_t middle = submaps[submap].middle();
    for (std::size_t i = cut.begin; i < cut.end; ++i) {
      const bool is_before = i < middle;
      const bool has_other =
          is_before ? submap > 0 && !cut.follows_jump
                    : submap + 1 < submaps.size() && !submaps[submap + 1].cut.follows_jump;
      poses[i] = moved_with(submap, i);
      if (i == middle || !has_other) continue;
      const std::size_t other = is_before ? submap - 1 : submap + 1;
      const double between_m = way_m[submaps[other].middle()] - way_m[middle];
      if (between_m == 0.0) continue;  // it stood
      poses[i] = Blend(poses[i], moved_with(other, i), (way_m[i] - way_m[middle]) / between_m);
    }
  }
  return poses;
}

}  // namespace atlas
