#include "core/scan/deskew.h"

#include <array>
#include <cmath>
#include <numbers>

namespace atlas {
namespace {

// Poses between; a step is 0.35 degrees of azimuth, 2 mm at 20 m/s.
constexpr int kSteps = 1024;

}  // namespace

void Deskew(RangeImage& image, const Pose& T_now_later) {
  const Eigen::AngleAxisd turn(T_now_later.linear());
  std::array<Eigen::Isometry3f, kSteps + 1> T_now_then;
  for (int i = 0; i <= kSteps; ++i) {
    const double fraction = static_cast<double>(i) / kSteps - 0.5;
    Pose pose = Pose::Identity();
    pose.linear() = Eigen::AngleAxisd(fraction * turn.angle(), turn.axis()).toRotationMatrix();
    pose.translation() = fraction * T_now_later.translation();
    T_now_then[static_cast<std::size_t>(i)] = pose.cast<float>();
  }
  for (std::size_t i = 0; i < image.size(); ++i) {
    const Eigen::Vector3f p_then(image.x[i], image.y[i], image.z[i]);
    const float azimuth = std::atan2(p_then.y(), p_then.x());
    const float fraction = 0.5F - azimuth / (2.0F * std::numbers::pi_v<float>);
    const auto step = static_cast<std::size_t>(std::lround(fraction * kSteps));
    const Eigen::Vector3f p_now = T_now_then[step] * p_then;
    image.x[i] = p_now.x();
    image.y[i] = p_now.y();
    image.z[i] = p_now.z();
  }
}

}  // namespace atlas
