// How a scan's features fit a map window: columns on vertical lines, ground on planes (robust
// residuals, point to line and point to plane).
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/pose.h"
#include "core/localization/registration/normal_equations.h"
#include "core/localization/registration/planar_sums.h"
#include "core/localization/registration/scan_features.h"
#include "core/localization/window/map_window.h"

namespace atlas {

struct FeatureFitOptions {
  float column_sigma_m = 0.12F;
  float ground_sigma_m = 0.05F;
  // Gentler slopes do not hold a vehicle in the horizontal: their gradient is mostly noise.
  float min_gradient = 0.06F;
};

// How far a feature's place in the map is looked for, and of which features.
struct FeatureReach {
  float column_m = 0.4F;
  float ground_m = 0.2F;
  std::size_t stride = 1;  // every so many-th of them
};

// What the features say about a pose, and how many of them.
struct FeatureEvidence {
  NormalEquations equations;
  int columns = 0;
  int ground = 0;
  // Of features where the map says something: how many, and the sum of their robust weights.
  int mapped_columns = 0;
  int mapped_ground = 0;
  double column_fit = 0.0;
  double ground_fit = 0.0;
};

class FeatureFit {
 public:
  // All outlive it.
  FeatureFit(const MapWindow& map, const ScanFeatures& features, const FeatureFitOptions& options)
      : map_(map), features_(features), options_(options) {}

  FeatureEvidence At(const Pose& T_world_level, const FeatureReach& reach) const;
  // The ground's part of it.
  FeatureEvidence OfGround(const Pose& T_world_level, const FeatureReach& reach) const;
  // The robust weight of each column, 0 where the map knows that nothing stands; none where it
  // knows nothing.
  void ColumnWeights(const Pose& T_world_level,
                     float radius_m,
                     std::vector<std::optional<float>>& weights) const;

 private:
  struct OnLine {
    ColumnLine line;
    Eigen::Vector2f residual = Eigen::Vector2f::Zero();
    float robust = 0.0F;
  };

  // Where a column at `p`, seen from there, stands.
  std::optional<OnLine> LineOf(const Eigen::Vector3f& p,
                               const Eigen::Vector2f& from,
                               float radius_m) const;
  void AddColumn(const Eigen::Vector3f& arm,
                 const Eigen::Vector3f& t,
                 float radius_m,
                 FeatureEvidence& evidence,
                 PlanarSums& sums) const;
  void AddGround(const Eigen::Vector3f& arm,
                 const Eigen::Vector3f& t,
                 float reach_m,
                 FeatureEvidence& evidence) const;

  const MapWindow& map_;
  const ScanFeatures& features_;
  const FeatureFitOptions& options_;
};

}  // namespace atlas
