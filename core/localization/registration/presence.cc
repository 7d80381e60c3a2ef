#include "core/localization/registration/presence.h"

#include <cmath>

#include "core/localization/registration/planar_sums.h"

namespace atlas {
namespace {

// As likely as a return of which so much lies in occupied segments is an outlier.
constexpr float kOutlier = 0.1F;

// Wide enough that within a wall of one cell its middle counts.
const CellKernel& Kernel() {
  constexpr float kSigma_cells = 0.4F;
  static const CellKernel kKernel(kSigma_cells);
  return kKernel;
}

// Without its negative part: a return between two places pulls to neither.
PlanarMatrix Positive(const PlanarMatrix& c) {
  const float mean = 0.5F * (c.xx + c.yy);
  const float half = 0.5F * (c.xx - c.yy);
  const float radius = std::sqrt(half * half + c.xy * c.xy);
  if (mean >= radius) {
    return c;
  }
  if (mean <= -radius) {
    return {};
  }
  const float scale = 0.5F * (mean + radius) / radius;
  return {scale * (half + radius), scale * c.xy, scale * (radius - half)};
}

}  // namespace

PresenceSum SumPresence(const MapWindow& map,
                        std::span<const Eigen::Vector3f> returns,
                        const Pose& T_world_level) {
  constexpr double kMuch = 1e100;
  const Eigen::Matrix3f R = T_world_level.linear().cast<float>();
  const Eigen::Vector3f t = (T_world_level.translation() - map.origin()).cast<float>();
  const CellKernel& kernel = Kernel();
  PlanarSums sums;
  PresenceSum result;
  double likelihood = 1.0;  // since the last logarithm
  for (const Eigen::Vector3f& p : returns) {
    const Eigen::Vector3f arm = R * p;
    const PointPresence at = map.PresenceAt(arm + t, kernel);
    if (at.value <= 0.0F) {
      continue;  // one of an outlier: log(1)
    }
    const float scale = 1.0F / (at.value + kOutlier);
    result.present += static_cast<double>(at.value);
    likelihood *= static_cast<double>(1.0F + at.value / kOutlier);
    if (likelihood > kMuch) {
      result.log_likelihood += std::log(likelihood);
      likelihood = 1.0;
    }
    const Eigen::Vector2f gradient = -scale * at.gradient;
    sums.Add(arm, gradient,
             Positive({gradient.x() * gradient.x() - scale * at.curve_xx,
                       gradient.x() * gradient.y() - scale * at.curve_xy,
                       gradient.y() * gradient.y() - scale * at.curve_yy}));
  }
  result.log_likelihood += std::log(likelihood);
  result.equations = sums.Equations();
  return result;
}

}  // namespace atlas
