// Normal equations of columns: points that are pulled in the horizontal plane, and say nothing of
// tilt. A keyframe's columns stand upright in its own level; where that was off, they lean in the
// map, and whoever stood them up by them would lean as well (decision 0627). Summed up without a
// product of matrices a point.
#pragma once

#include <Eigen/Core>

#include "core/localization/registration/normal_equations.h"

namespace atlas {

// A symmetric 2 x 2 matrix.
struct PlanarMatrix {
  float xx = 0.0F;
  float xy = 0.0F;
  float yy = 0.0F;
};

// Sums of what forces in the plane on points say of (x, y, yaw).
class PlanarSums {
 public:
  // A point at `arm` from the sensor: the gradient there, and its change with the point's place.
  void Add(const Eigen::Vector3f& arm, const Eigen::Vector2f& gradient, const PlanarMatrix& c) {
    const double x = arm.x(), y = arm.y();
    const double a = c.xx, b = c.xy, d = c.yy;
    // How the two forces change with a turn about z.
    const double turn_x = b * x - a * y;
    const double turn_y = d * x - b * y;
    xx_ += a;
    xy_ += b;
    yy_ += d;
    turn_x_ += turn_x;
    turn_y_ += turn_y;
    turn_ += turn_y * x - turn_x * y;
    const double gx = gradient.x(), gy = gradient.y();
    g_x_ += gx;
    g_y_ += gy;
    g_turn_ += gy * x - gx * y;
  }

  // x and y move with (t_x - w_z y, t_y + w_z x).
  NormalEquations Equations() const {
    NormalEquations equations;
    auto& H = equations.H;
    H(0, 0) = xx_;
    H(1, 0) = xy_;
    H(1, 1) = yy_;
    H(5, 0) = turn_x_;
    H(5, 1) = turn_y_;
    H(5, 5) = turn_;
    equations.g << g_x_, g_y_, 0.0, 0.0, 0.0, g_turn_;
    return equations;
  }

 private:
  double xx_ = 0.0, xy_ = 0.0, yy_ = 0.0;
  double turn_x_ = 0.0, turn_y_ = 0.0, turn_ = 0.0;
  double g_x_ = 0.0, g_y_ = 0.0, g_turn_ = 0.0;
};

}  // namespace atlas
