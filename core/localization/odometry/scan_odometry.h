// How a vehicle moved since its last scans, by those alone: its scan is fitted to what they saw,
// columns to lines and ground to planes (robust Gauss-Newton on SE(3), as Register does in a map).
#pragma once

#include <cstddef>

#include <Eigen/Core>

#include "core/geometry/pose.h"
#include "core/localization/odometry/recent_scans.h"
#include "core/localization/registration/pose_prior.h"
#include "core/localization/registration/scan_features.h"

namespace atlas {

struct ScanOdometryOptions {
  std::size_t scans = 8;        // that are kept
  float coarse_reach_m = 1.5F;  // how far a neighbour is looked for at first ...
  float fine_reach_m = 0.4F;    // ... and in the end
  int iterations = 10;          // while the reach becomes smaller,
  int fine_iterations = 6;      // and then
  float column_sigma_m = 0.12F;
  float ground_sigma_m = 0.05F;
  double tilt_sigma_rad = 0.0087;  // the IMU's: 0.5 degrees
  double start_sigma_m = 0.5;      // of each start
  double start_sigma_rad = 0.05;
  // Where the step is less certain than this, starts are tried along the least certain direction,
  // up to so many standard deviations either way; all of them, and the best counts.
  double fan_sigma_m = 0.8;
  double fan_sigmas = 1.5;
  double fan_step_m = 0.75;
  double as_good_fit = 0.05;  // so much less fits as well: ground, or a wall, alone
  // Clear is a motion if none that is further than this from it fits so much of it: of a row of
  // posts those at its ends are new where it drove on, and none of them where it stood.
  double clear_share = 0.75;
  double clear_m = 0.5;
  // Where a scan fits by less than this, it may have turned more than expected: so many times so
  // much is tried to either side.
  double sure_fit = 0.5;
  int turns = 3;
  double turn_rad = 0.12;
  std::size_t fanned_turns = 8;  // of all starts that are fanned and turned so many, the best ones
  float max_range_m = 25.0F;     // the fit is that of nearer columns: further off much is new

  // A scan that fits less was taken elsewhere: the vehicle was moved, or saw too little.
  double min_fit = 0.35;
  // With fewer columns that are near all count, of which so many were seen before, or else the
  // ground.
  int few_columns = 30;
  double far_known = 0.4;
  double information_share = 0.08;  // neighbouring features err together (SeenOptions)
};

struct ScanMotion {
  Pose T_world_level = Pose::Identity();
  PoseCovariance covariance = PoseCovariance::Zero();  // as far as the scans tell
  bool is_clear = true;                                // of all that were tried
  double fit = 0.0;  // mean robust weight, 0..1: of the columns that are near, where there are
};

// Where the scan was taken, near where it is `expected`; the covariance is that of the step to
// there. Requires scans. A `fit` below `min_fit`: not where it can have been driven to.
ScanMotion MotionSince(const RecentScans& recent,
                       const ScanFeatures& features,
                       const PosePrior& expected,
                       const ScanOdometryOptions& options);

}  // namespace atlas
