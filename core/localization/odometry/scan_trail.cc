#include "core/localization/odometry/scan_trail.h"

#include <algorithm>

namespace atlas {

void ScanTrail::Keep(const ScanFeatures& features, const Pose& T_world_level) {
  if (!recent_.is_empty() &&
      !AreApart(T_world_level, last_kept_, options_.kept_apart_m, options_.kept_apart_rad)) {
    return;
  }
  recent_.Add(features, T_world_level);
  last_kept_ = T_world_level;
}

// What errs alike all the way adds the more to the variance the longer that is.
PoseCovariance ScanTrail::Go(const ScanMotion& moved, double step_m) {
  way_m_ += step_m;
  const Eigen::Vector4d each(options_.step_m, options_.step_m, options_.step_up_m,
                             options_.step_rad);
  const Eigen::Vector4d drift(options_.drift, options_.drift, options_.drift_up, 0.0);
  PoseCovariance covariance = moved.covariance;
  covariance.diagonal() +=
      std::min(1.0, step_m) * each.cwiseAbs2() + 2.0 * way_m_ * step_m * drift.cwiseAbs2();
  return covariance;
}

}  // namespace atlas
