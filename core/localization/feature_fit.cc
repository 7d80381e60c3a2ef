#include "core/localization/feature_fit.h"

#include <cmath>

namespace atlas {
namespace {

// Geman-McClure: a residual of several scales has no say.
double RobustWeight(double residual, double scale) {
  const double ratio = residual / scale;
  const double denominator = 1.0 + ratio * ratio;
  return 1.0 / (denominator * denominator);
}

}  // namespace

FeatureEvidence FeatureFit::At(const Pose& T_world_level, const FeatureReach& reach) const {
  FeatureEvidence evidence = OfGround(T_world_level, reach);
  const Eigen::Matrix3f R = T_world_level.linear().cast<float>();
  const Eigen::Vector3f t = (T_world_level.translation() - map_.origin()).cast<float>();
  for (const Eigen::Vector3f& p : features_.columns) {
    AddColumn(R * p, t, reach.column_m, evidence);
  }
  return evidence;
}

FeatureEvidence FeatureFit::OfGround(const Pose& T_world_level, const FeatureReach& reach) const {
  FeatureEvidence evidence;
  const Eigen::Matrix3f R = T_world_level.linear().cast<float>();
  const Eigen::Vector3f t = (T_world_level.translation() - map_.origin()).cast<float>();
  for (const Eigen::Vector3f& p : features_.ground) {
    AddGround(R * p, t, reach.ground_m, evidence);
  }
  return evidence;
}

void FeatureFit::AddColumn(const Eigen::Vector3f& arm,
                           const Eigen::Vector3f& t,
                           float radius_m,
                           FeatureEvidence& evidence) const {
  const Eigen::Vector3f p = arm + t;
  const ColumnLine* line = map_.NearestLine(p, radius_m);
  if (line != nullptr && !line->CanBeSeenFrom(t.head<2>())) {
    line = nullptr;
  }
  evidence.mapped_columns += line != nullptr || map_.IsFree(p) ? 1 : 0;
  if (line == nullptr) {
    return;
  }
  const Eigen::Vector2f offset = p.head<2>() - line->center;
  const double along_normal = line->normal.dot(offset);
  const Eigen::Vector2f tangent(-line->normal.y(), line->normal.x());
  const double along_tangent = line->is_wall ? 0.0 : tangent.dot(offset);
  const double scale = 0.4 * radius_m;
  const double robust = RobustWeight(std::hypot(along_normal, along_tangent), scale);
  const double weight = robust / (options_.column_sigma_m * options_.column_sigma_m);
  ++evidence.columns;
  evidence.column_fit += robust;
  evidence.equations.Add({line->normal.x(), line->normal.y(), 0.0}, arm.cast<double>(),
                         along_normal, weight);
  if (!line->is_wall) {
    evidence.equations.Add({tangent.x(), tangent.y(), 0.0}, arm.cast<double>(), along_tangent,
                           weight);
  }
}

void FeatureFit::AddGround(const Eigen::Vector3f& arm,
                           const Eigen::Vector3f& t,
                           float reach_m,
                           FeatureEvidence& evidence) const {
  float height_m = 0.0F;
  evidence.mapped_ground += map_.IsMapped(arm + t) ? 1 : 0;
  const SurfacePlane* plane = map_.NearestSurface(arm + t, reach_m, &height_m);
  if (plane == nullptr) {
    return;
  }
  const bool is_slope = plane->gradient.norm() >= options_.min_gradient;
  const Eigen::Vector3d normal =
      is_slope ? Eigen::Vector3d(-plane->gradient.x(), -plane->gradient.y(), 1.0).normalized()
               : Eigen::Vector3d::UnitZ();
  const double residual = height_m * normal.z();
  const double robust = RobustWeight(residual, 0.4 * reach_m);
  const double weight = robust / (options_.ground_sigma_m * options_.ground_sigma_m);
  ++evidence.ground;
  evidence.ground_fit += robust;
  evidence.equations.Add(normal, arm.cast<double>(), residual, weight);
}

}  // namespace atlas
