#include "core/localization/presence.h"

#include <cmath>

namespace atlas {
namespace {

// A symmetric 2 x 2 matrix.
struct Curvature {
  float xx = 0.0F;
  float xy = 0.0F;
  float yy = 0.0F;
};

// Without its negative part: a return between two places pulls to neither.
Curvature Positive(const Curvature& c) {
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

// Sums of what a return's gradient and curvature say of the pose.
class Sums {
 public:
  void Add(const Eigen::Vector3f& arm, const Eigen::Vector2f& gradient, const Curvature& c) {
    const double x = arm.x(), y = arm.y(), z = arm.z();
    const double a = c.xx, b = c.xy, d = c.yy;
    // How the two forces change with a turn about z.
    const double turn_x = b * x - a * y;
    const double turn_y = d * x - b * y;
    xx_ += a;
    xy_ += b;
    yy_ += d;
    az_ += a * z;
    bz_ += b * z;
    dz_ += d * z;
    azz_ += a * z * z;
    bzz_ += b * z * z;
    dzz_ += d * z * z;
    turn_x_ += turn_x;
    turn_y_ += turn_y;
    turn_xz_ += turn_x * z;
    turn_yz_ += turn_y * z;
    turn_ += turn_y * x - turn_x * y;
    const double gx = gradient.x(), gy = gradient.y();
    g_x_ += gx;
    g_y_ += gy;
    g_xz_ += gx * z;
    g_yz_ += gy * z;
    g_turn_ += gy * x - gx * y;
  }

  // x and y move with (t_x + w_y z - w_z y, t_y + w_z x - w_x z).
  NormalEquations Equations() const {
    NormalEquations equations;
    auto& H = equations.H;
    H(0, 0) = xx_;
    H(1, 0) = xy_;
    H(1, 1) = yy_;
    H(3, 0) = -bz_;
    H(3, 1) = -dz_;
    H(3, 3) = dzz_;
    H(4, 0) = az_;
    H(4, 1) = bz_;
    H(4, 3) = -bzz_;
    H(4, 4) = azz_;
    H(5, 0) = turn_x_;
    H(5, 1) = turn_y_;
    H(5, 3) = -turn_yz_;
    H(5, 4) = turn_xz_;
    H(5, 5) = turn_;
    equations.g << g_x_, g_y_, 0.0, -g_yz_, g_xz_, g_turn_;
    return equations;
  }

 private:
  double xx_ = 0.0, xy_ = 0.0, yy_ = 0.0;
  double az_ = 0.0, bz_ = 0.0, dz_ = 0.0;
  double azz_ = 0.0, bzz_ = 0.0, dzz_ = 0.0;
  double turn_x_ = 0.0, turn_y_ = 0.0, turn_xz_ = 0.0, turn_yz_ = 0.0, turn_ = 0.0;
  double g_x_ = 0.0, g_y_ = 0.0, g_xz_ = 0.0, g_yz_ = 0.0, g_turn_ = 0.0;
};

}  // namespace

PresenceSum Presence::Sum(const MapWindow& map,
                          std::span<const Eigen::Vector3f> returns,
                          const Pose& T_world_level) const {
  const Eigen::Matrix3f R = T_world_level.linear().cast<float>();
  const Eigen::Vector3f t = (T_world_level.translation() - map.origin()).cast<float>();
  Sums sums;
  PresenceSum result;
  for (const Eigen::Vector3f& p : returns) {
    const Eigen::Vector3f arm = R * p;
    const PointPresence at = map.PresenceAt(arm + t, kernel_);
    if (at.value <= 0.0F) {
      continue;  // one of an outlier: log(1)
    }
    const float scale = 1.0F / (at.value + options_.outlier);
    result.log_likelihood += static_cast<double>(std::log1p(at.value / options_.outlier));
    const Eigen::Vector2f gradient = -scale * at.gradient;
    sums.Add(arm, gradient,
             Positive({gradient.x() * gradient.x() - scale * at.curve_xx,
                       gradient.x() * gradient.y() - scale * at.curve_xy,
                       gradient.y() * gradient.y() - scale * at.curve_yy}));
  }
  result.equations = sums.Equations();
  return result;
}

}  // namespace atlas
