// Normal equations of points that are pulled in the horizontal plane alone, summed up without a
// product of matrices a point.
#pragma once

#include <Eigen/Core>

#include "core/localization/normal_equations.h"

namespace atlas {

// A symmetric 2 x 2 matrix.
struct PlanarMatrix {
  float xx = 0.0F;
  float xy = 0.0F;
  float yy = 0.0F;
};

// Sums of what forces in the plane on points say of a pose.
class PlanarSums {
 public:
  // A point at `arm` from the sensor: the gradient there, and its change with the point's place.
  void Add(const Eigen::Vector3f& arm, const Eigen::Vector2f& gradient, const PlanarMatrix& c) {
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

}  // namespace atlas
