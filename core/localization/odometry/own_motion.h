// How a vehicle that may be anywhere moves from scan to scan, by its scans alone: wherever it is,
// there it moves so.
#pragma once

#include "core/geometry/pose.h"
#include "core/localization/odometry/motion_model.h"
#include "core/localization/odometry/recent_scans.h"
#include "core/localization/odometry/scan_odometry.h"
#include "core/localization/registration/pose_prior.h"
#include "core/localization/registration/scan_features.h"

namespace atlas {

// Levelled frames; `covariance` along the axes of the last one.
struct OwnStep {
  Pose T_last_now = Pose::Identity();
  PoseCovariance covariance = PoseCovariance::Zero();
  // Else the scans do not fit to each other: it was moved, or saw too little.
  bool is_known = false;
  bool is_sure = false;  // they fit well, and nowhere else nearly as well
};

class OwnMotion {
 public:
  OwnMotion(const MotionOptions& motion,
            const PauseOptions& pause,
            const ScanOdometryOptions& odometry)
      : pause_(pause), odometry_(odometry), recent_(odometry.scans), motion_(motion) {}

  void Forget() { recent_.Clear(); }
  bool is_begun() const { return !recent_.is_empty(); }
  // Of the scan before the first step.
  void Begin(const ScanFeatures& features);
  // To the next scan, so many times the usual time later. Requires is_begun(); where the step is
  // not known it begins anew.
  OwnStep Next(const ScanFeatures& features, double scans);

 private:
  PauseOptions pause_;
  ScanOdometryOptions odometry_;
  RecentScans recent_;  // in a frame that begins where it did
  MotionModel motion_;
};

}  // namespace atlas
