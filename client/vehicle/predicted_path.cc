#include "client/vehicle/predicted_path.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "core/base/str_cat.h"
#include "core/geometry/map_area.h"

namespace atlas {
namespace {

constexpr double kMaxSegments = CorridorArea::kMaxRoutePoints - 1;

// As a chord: its length goes to that of the arc as the turn goes to 0, without a division by it.
Eigen::Vector2d PlaceAfter(const PlanarMotion& motion, double time_s) {
  const double half_turn_rad = 0.5 * motion.yaw_rate_rad_s * time_s;
  const double shorter = half_turn_rad == 0.0 ? 1.0 : std::sin(half_turn_rad) / half_turn_rad;
  const double chord_m = motion.speed_m_s * time_s * shorter;
  const double direction_rad = motion.heading_rad + half_turn_rad;
  return motion.position_m +
         chord_m * Eigen::Vector2d(std::cos(direction_rad), std::sin(direction_rad));
}

}  // namespace

Result<std::vector<Eigen::Vector2d>> PredictedPath(const PlanarMotion& motion,
                                                   double horizon_s,
                                                   double spacing_m) {
  const double turn_rad = motion.yaw_rate_rad_s * horizon_s;
  const double length_m = motion.speed_m_s * horizon_s;
  const bool is_finite = motion.position_m.allFinite() && std::isfinite(motion.heading_rad) &&
                         std::isfinite(turn_rad) && std::isfinite(length_m);
  if (!is_finite || !(horizon_s >= 0.0) || !(spacing_m > 0.0)) {
    return Error(StatusCode::kInvalidArgument,
                 StrCat("predicted path: expected finite numbers, a horizon of 0 s or more and a "
                        "spacing above 0 m, not ",
                        horizon_s, " s and ", spacing_m, " m"));
  }
  const double full_turns = std::abs(turn_rad) / (2.0 * std::numbers::pi);
  const double part = 1.0 / std::max(1.0, full_turns);
  const double segments =
      std::clamp(std::ceil(part * std::abs(length_m) / spacing_m), 0.0, kMaxSegments);
  std::vector<Eigen::Vector2d> path_m{motion.position_m};
  for (double segment = 1.0; segment <= segments; ++segment) {
    path_m.push_back(PlaceAfter(motion, part * horizon_s * segment / segments));
  }
  return path_m;
}

}  // namespace atlas
