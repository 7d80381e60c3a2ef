// The last scans of a vehicle that knew where it was, each where it was taken: where the map has
// little or nothing they tell where it went from there.
#pragma once

#include "core/geometry/pose.h"
#include "core/localization/odometry/recent_scans.h"
#include "core/localization/odometry/scan_odometry.h"
#include "core/localization/registration/pose_prior.h"
#include "core/localization/registration/scan_features.h"

namespace atlas {

struct ScanTrailOptions {
  ScanOdometryOptions odometry;
  // Scans are kept that are so far from each other: of one spot one is enough.
  double kept_apart_m = 0.3;
  double kept_apart_rad = 0.1;
  // However well scans fit to each other, a step of a metre or more is known no better than this,
  // standard deviations; a shorter one as much better as it is shorter.
  double step_m = 0.02;
  double step_up_m = 0.015;
  double step_rad = 0.0015;
  // What errs all the way, the IMU's tilt first of all: standard deviations, a metre of the way.
  double drift = 0.003;
  double drift_up = 0.003;
};

class ScanTrail {
 public:
  explicit ScanTrail(const ScanTrailOptions& options)
      : options_(options), recent_(options.odometry.scans) {}

  void Clear() { recent_.Clear(); }
  bool is_empty() const { return recent_.is_empty(); }
  void Keep(const ScanFeatures& features, const Pose& T_world_level);

  // Where a scan was taken, near where it is `expected`. Requires scans.
  ScanMotion MotionTo(const ScanFeatures& features, const PosePrior& expected) const {
    return MotionSince(recent_, features, expected, options_.odometry);
  }
  bool IsKnown(const ScanMotion& moved) const { return moved.fit >= options_.odometry.min_fit; }
  bool IsSure(const ScanMotion& moved) const { return moved.fit >= options_.odometry.sure_fit; }

  // From here on steps are added up to a way; each with what errs on the way there.
  void BeginWay() { way_m_ = 0.0; }
  PoseCovariance Go(const ScanMotion& moved, double step_m);

 private:
  ScanTrailOptions options_;
  RecentScans recent_;
  Pose last_kept_ = Pose::Identity();  // where the last of them was taken
  double way_m_ = 0.0;
};

}  // namespace atlas
