#include "core/scan/deskew.h"

#include <array>
#include <cmath>
#include <numbers>

namespace atlas {
namespace {

// Where the sensor is during a revolution.
class Revolution {
 public:
  explicit Revolution(const Pose& T_now_later) {
    const Eigen::AngleAxisd turn(T_now_later.linear());
    for (int i = 0; i <= kSteps; ++i) {
      const double fraction = static_cast<double>(i) / kSteps - 0.5;
      Pose pose = Pose::Identity();
      pose.linear() = Eigen::AngleAxisd(fraction * turn.angle(), turn.axis()).toRotationMatrix();
      pose.translation() = fraction * T_now_later.translation();
      T_now_then_[static_cast<std::size_t>(i)] = pose.cast<float>();
    }
  }

  const Eigen::Isometry3f& At(const Eigen::Vector3f& p_then) const {
    const float azimuth = std::atan2(p_then.y(), p_then.x());
    const float fraction = 0.5F - azimuth / (2.0F * std::numbers::pi_v<float>);
    return T_now_then_[static_cast<std::size_t>(std::lround(fraction * kSteps))];
  }

 private:
  // A step is 0.35 degrees of azimuth, 2 mm at 20 m/s.
  static constexpr int kSteps = 1024;

  std::array<Eigen::Isometry3f, kSteps + 1> T_now_then_;
};

}  // namespace

void Deskew(RangeImage& image, const Pose& T_now_later) {
  const Revolution revolution(T_now_later);
  for (std::size_t i = 0; i < image.size(); ++i) {
    const Eigen::Vector3f p_then(image.x[i], image.y[i], image.z[i]);
    const Eigen::Vector3f p_now = revolution.At(p_then) * p_then;
    image.x[i] = p_now.x();
    image.y[i] = p_now.y();
    image.z[i] = p_now.z();
  }
}

void Deskew(LeveledScan& scan, const Eigen::Quaterniond& R_level_sensor, const Pose& T_now_later) {
  const Revolution revolution(T_now_later);
  const Eigen::Matrix3f R = R_level_sensor.cast<float>().toRotationMatrix();
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const Eigen::Vector3f p_then = R.transpose() * Eigen::Vector3f(scan.x[i], scan.y[i], scan.z[i]);
    const Eigen::Vector3f p_now = R * (revolution.At(p_then) * p_then);
    scan.x[i] = p_now.x();
    scan.y[i] = p_now.y();
    scan.z[i] = p_now.z();
    scan.range_m[i] = std::hypot(p_now.x(), p_now.y());
    const float azimuth = std::atan2(p_now.y(), p_now.x());
    scan.azimuth_rad[i] = azimuth < 0.0F ? azimuth + 2.0F * std::numbers::pi_v<float> : azimuth;
  }
}

}  // namespace atlas
