#include "core/localization/registration/feature_fit.h"

#include <cmath>
#include <optional>

namespace atlas {
namespace {

// Geman-McClure: a residual of several scales has no say.
float RobustWeight(float residual, float scale) {
  const float ratio = residual / scale;
  const float denominator = 1.0F + ratio * ratio;
  return 1.0F / (denominator * denominator);
}

constexpr float kScale = 0.4F;  // of a residual, by how far it is looked for

}  // namespace

FeatureEvidence FeatureFit::At(const Pose& T_world_level, const FeatureReach& reach) const {
  FeatureEvidence evidence = OfGround(T_world_level, reach);
  PlanarSums sums;
  const Eigen::Matrix3f R = T_world_level.linear().cast<float>();
  const Eigen::Vector3f t = (T_world_level.translation() - map_.origin()).cast<float>();
  for (std::size_t i = 0; i < features_.columns.size(); i += reach.stride) {
    AddColumn(R * features_.columns[i], t, reach.column_m, evidence, sums);
  }
  evidence.equations += sums.Equations();
  return evidence;
}

FeatureEvidence FeatureFit::OfGround(const Pose& T_world_level, const FeatureReach& reach) const {
  FeatureEvidence evidence;
  const Eigen::Matrix3f R = T_world_level.linear().cast<float>();
  const Eigen::Vector3f t = (T_world_level.translation() - map_.origin()).cast<float>();
  for (std::size_t i = 0; i < features_.ground.size(); i += reach.stride) {
    AddGround(R * features_.ground[i], t, reach.ground_m, evidence);
  }
  return evidence;
}

void FeatureFit::ColumnWeights(const Pose& T_world_level,
                               float radius_m,
                               std::vector<std::optional<float>>& weights) const {
  weights.clear();
  const Eigen::Matrix3f R = T_world_level.linear().cast<float>();
  const Eigen::Vector3f t = (T_world_level.translation() - map_.origin()).cast<float>();
  for (const Eigen::Vector3f& column : features_.columns) {
    const Eigen::Vector3f p = R * column + t;
    const std::optional<OnLine> on = LineOf(p, t.head<2>(), radius_m);
    weights.push_back(on               ? std::optional(on->robust)
                      : map_.IsFree(p) ? std::optional(0.0F)
                                       : std::nullopt);
  }
}

std::optional<FeatureFit::OnLine> FeatureFit::LineOf(const Eigen::Vector3f& p,
                                                     const Eigen::Vector2f& from,
                                                     float radius_m) const {
  const std::optional<ColumnLine> line = map_.NearestLine(p, radius_m);
  if (!line || !line->CanBeSeenFrom(from)) {
    return std::nullopt;
  }
  const Eigen::Vector2f offset = p.head<2>() - line->center;
  const Eigen::Vector2f& n = line->normal;
  const Eigen::Vector2f residual = line->is_wall ? Eigen::Vector2f(n.dot(offset) * n) : offset;
  return OnLine{*line, residual, RobustWeight(residual.norm(), kScale * radius_m)};
}

void FeatureFit::AddColumn(const Eigen::Vector3f& arm,
                           const Eigen::Vector3f& t,
                           float radius_m,
                           FeatureEvidence& evidence,
                           PlanarSums& sums) const {
  const Eigen::Vector3f p = arm + t;
  const std::optional<OnLine> on = LineOf(p, t.head<2>(), radius_m);
  evidence.mapped_columns += on || map_.IsFree(p) ? 1 : 0;
  if (!on) {
    return;
  }
  const Eigen::Vector2f& n = on->line.normal;
  const float weight = on->robust / (options_.column_sigma_m * options_.column_sigma_m);
  ++evidence.columns;
  evidence.column_fit += static_cast<double>(on->robust);
  const PlanarMatrix metric =
      on->line.is_wall
          ? PlanarMatrix{weight * n.x() * n.x(), weight * n.x() * n.y(), weight * n.y() * n.y()}
          : PlanarMatrix{weight, 0.0F, weight};
  sums.Add(arm, weight * on->residual, metric);
}

void FeatureFit::AddGround(const Eigen::Vector3f& arm,
                           const Eigen::Vector3f& t,
                           float reach_m,
                           FeatureEvidence& evidence) const {
  evidence.mapped_ground += map_.IsMapped(arm + t) ? 1 : 0;
  const std::optional<SurfaceBelow> below = map_.NearestSurface(arm + t, reach_m);
  if (!below) {
    return;
  }
  const Eigen::Vector2f& gradient = below->plane.gradient;
  const bool is_slope = gradient.norm() >= options_.min_gradient;
  const Eigen::Vector3d normal =
      is_slope ? Eigen::Vector3d(-gradient.x(), -gradient.y(), 1.0).normalized()
               : Eigen::Vector3d::UnitZ();
  const double residual = below->height_m * normal.z();
  const auto robust =
      static_cast<double>(RobustWeight(static_cast<float>(residual), kScale * reach_m));
  const double weight = robust / (options_.ground_sigma_m * options_.ground_sigma_m);
  ++evidence.ground;
  evidence.ground_fit += robust;
  evidence.equations.Add(normal, arm.cast<double>(), residual, weight);
}

}  // namespace atlas
