// Fits a scan into a map window on SE(3), coarse to fine: by lines and planes, which reach far
// (Gauss-Newton with a robust kernel), then so that its returns lie in occupied segments (decision
// 0602).
#pragma once

#include <Eigen/Core>

#include "core/geometry/pose.h"
#include "core/localization/registration/feature_fit.h"
#include "core/localization/registration/pose_prior.h"
#include "core/localization/registration/presence.h"
#include "core/localization/registration/scan_features.h"
#include "core/localization/window/map_window.h"

namespace atlas {

struct RegistrationOptions {
  float coarse_radius_m = 1.2F;  // how far a column is looked for at first ...
  float fine_radius_m = 0.4F;    // ... and in the end
  float coarse_reach_m = 0.6F;   // the same for the ground's height
  float fine_reach_m = 0.2F;
  FeatureFitOptions features;
  double tilt_sigma_rad = 0.0087;  // the IMU's: 0.5 degrees
  // How well the start is known: where nothing seen holds the vehicle, it stays there.
  double start_sigma_m = 0.5;
  double start_sigma_rad = 0.03;
  int coarse_iterations = 5;
  std::size_t coarse_stride = 3;  // of the features looked at until then
  int max_iterations = 15;        // of the last stage
  // Of the returns, in occupied segments where the last stage begins; with less it goes by lines.
  double min_present = 0.2;
  double converged_m = 1e-3;
  double converged_rad = 1e-4;
};

struct RegistrationResult {
  Pose T_world_level = Pose::Identity();
  // Of (translation, rotation vector), world axes, about the sensor.
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
  double column_inliers = 0.0;  // share of column points that found a line, 0..1
  double ground_inliers = 0.0;
  int matched_columns = 0;
  // Mean robust weight, 0..1, of the features that fall on cells the map knows, unmatched ones 0;
  // 0 where too few do to tell. What was never mapped speaks neither for nor against a pose.
  double fit = 0.0;
  double column_fit = 1.0;  // the same of columns alone, 1 where too few do to tell
  // How much more of the scan the map explains than contradicts: 1 for a feature that fits, -0.5
  // for one where the map knows better. Tells places apart, where `fit` tells how good one is.
  double evidence = 0.0;
  bool is_converged = false;
};

// Standard deviation of the least certain horizontal direction with height and heading as uncertain
// as they are, as far as features are independent, metres; 1e9 where nothing holds it.
double WorstSigma(const RegistrationResult& result);

RegistrationResult Register(const MapWindow& map,
                            const ScanFeatures& features,
                            const Pose& T_world_level_start,
                            const PosePrior& prior,
                            const RegistrationOptions& options);
// With a prior at the start of the options' sigmas.
RegistrationResult Register(const MapWindow& map,
                            const ScanFeatures& features,
                            const Pose& T_world_level_start,
                            const RegistrationOptions& options);

}  // namespace atlas
