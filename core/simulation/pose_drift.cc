#include "core/simulation/pose_drift.h"

#include <array>
#include <cmath>

#include "core/base/hash_random.h"

namespace atlas {
namespace {

// A smooth wave along the way, between -1 and 1: two sines of unlike lengths.
class Wave {
 public:
  Wave(HashRandom& random, double wavelength_m)
      : sines_{Sine{2.0 * std::numbers::pi / (wavelength_m * random.Uniform(1.0, 2.0)),
                    random.Uniform(0.0, 2.0 * std::numbers::pi)},
               Sine{2.0 * std::numbers::pi / (wavelength_m * random.Uniform(0.3, 0.7)),
                    random.Uniform(0.0, 2.0 * std::numbers::pi)}} {}

  double At(double way_m) const {
    double sum = 0.0;
    for (const Sine& sine : sines_) {
      sum += 0.5 * std::sin(sine.turns_a_m * way_m + sine.phase);
    }
    return sum;
  }

 private:
  struct Sine {
    double turns_a_m;
    double phase;
  };
  std::array<Sine, 2> sines_;
};

// An error per metre: mostly of one sign.
class Rate {
 public:
  Rate(HashRandom& random, double size, const DriftOptions& options)
      : wave_(random, options.wavelength_m),
        steady_((random.Below(2) == 0 ? -1.0 : 1.0) * options.steady * size),
        wandering_((1.0 - options.steady) * size) {}

  double At(double way_m) const { return steady_ + wandering_ * wave_.At(way_m); }

 private:
  Wave wave_;
  double steady_;
  double wandering_;
};

class Drift {
 public:
  explicit Drift(const DriftOptions& options) : Drift(options, HashRandom(options.seed)) {}

  // What is added to a step of the vehicle, in its frame.
  Eigen::Vector3d Shift(double way_m, double step_m) const {
    return step_m * Eigen::Vector3d(x_.At(way_m), y_.At(way_m), z_.At(way_m));
  }
  double Turn(double way_m, double step_m) const { return step_m * yaw_.At(way_m); }
  Eigen::Quaterniond Tilt(double way_m) const {
    return Eigen::AngleAxisd(tilt_rad_ * pitch_.At(way_m), Eigen::Vector3d::UnitY()) *
           Eigen::AngleAxisd(tilt_rad_ * roll_.At(way_m), Eigen::Vector3d::UnitX());
  }

 private:
  Drift(const DriftOptions& options, HashRandom random)
      : x_(random, options.position, options),
        y_(random, options.position, options),
        z_(random, options.position, options),
        yaw_(random, options.yaw_rad_a_m, options),
        roll_(random, options.wavelength_m),
        pitch_(random, options.wavelength_m),
        tilt_rad_(options.tilt_rad) {}

  Rate x_;
  Rate y_;
  Rate z_;
  Rate yaw_;
  Wave roll_;
  Wave pitch_;
  double tilt_rad_;
};

Eigen::Matrix3d Heading(double yaw_rad) {
  return Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

}  // namespace

Status DriftOptions::Validate() const {
  const auto is_share = [](double value) {
    return value >= 0.0 && value <= 1.0;
  };
  if (!is_share(position)) return {StatusCode::kInvalidArgument, "drift: position is not 0 to 1"};
  if (!(yaw_rad_a_m >= 0.0 && yaw_rad_a_m < 1.0)) {
    return {StatusCode::kInvalidArgument, "drift: yaw is not 0 to 1 rad a metre"};
  }
  if (!(tilt_rad >= 0.0 && tilt_rad < 0.1)) {
    return {StatusCode::kInvalidArgument, "drift: tilt is not 0 to 0.1 rad"};
  }
  if (!is_share(steady)) return {StatusCode::kInvalidArgument, "drift: steady is not 0 to 1"};
  if (!(wavelength_m > 0.0)) {
    return {StatusCode::kInvalidArgument, "drift: wavelength is not above 0"};
  }
  return {};
}

// Steps are taken upright, as the vehicle would measure them: the tilt is known by itself, and does
// not add up.
std::vector<Pose> Drifted(std::span<const Pose> T_world_sensor,
                          const DriftOptions& options,
                          double jump_m) {
  const Drift drift(options);
  std::vector<Pose> drifted;
  drifted.reserve(T_world_sensor.size());
  double way_m = 0.0;
  double turned_rad = 0.0;  // of the drifted heading from the true one
  for (std::size_t i = 0; i < T_world_sensor.size(); ++i) {
    const Pose& truth = T_world_sensor[i];
    Eigen::Vector3d place = truth.translation();
    if (i > 0) {
      Eigen::Vector3d step = truth.translation() - T_world_sensor[i - 1].translation();
      const double step_m = step.norm();
      if (step_m <= jump_m) {
        const double yaw_rad = SplitYaw(Eigen::Quaterniond(T_world_sensor[i - 1].linear())).yaw_rad;
        step = Heading(turned_rad) * (step + Heading(yaw_rad) * drift.Shift(way_m, step_m));
        turned_rad += drift.Turn(way_m, step_m);
        way_m += step_m;
      }
      place = drifted.back().translation() + step;
    }
    const YawAndLevel split = SplitYaw(Eigen::Quaterniond(truth.linear()));
    Pose pose = Pose::Identity();
    pose.translation() = place;
    pose.linear() = Heading(split.yaw_rad + turned_rad) *
                    (drift.Tilt(way_m) * split.R_level_sensor).normalized().toRotationMatrix();
    drifted.push_back(pose);
  }
  return drifted;
}

}  // namespace atlas
