#include "core/keyframe/sensor_mount.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "core/base/str_cat.h"
#include "core/keyframe/keyframe.h"

namespace atlas {
namespace {

constexpr double kMinHeight_m = 1e-3 * Keyframe::kMinSensorHeight_mm;
constexpr double kMaxHeight_m = 1e-3 * Keyframe::kMaxSensorHeight_mm;

double Median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double MedianHeight(std::span<const Eigen::Vector3d> points) {
  std::vector<double> heights_m;
  for (const Eigen::Vector3d& point : points) {
    heights_m.push_back(point.z());
  }
  return Median(std::move(heights_m));
}

// z = plane.x x + plane.y y + plane.z, levelled frame, and how well it fits.
struct GroundFit {
  Eigen::Vector3d plane;
  double spread_m = 0.0;
};

// Where the ground that the wheels stand on is looked for.
struct Reach {
  float ahead_m;  // and behind
  float half_width_m;
};
constexpr float kLane_m = 1.5F;
constexpr float kAnywhere_m = 100.0F;
// A VLP-16 3.8 m up sees its lane 14 m away; what is nearer all around are roofs of parked cars.
constexpr std::array<Reach, 4> kReaches = {
    {{12.0F, kLane_m}, {25.0F, kLane_m}, {12.0F, kAnywhere_m}, {25.0F, kAnywhere_m}}};

std::vector<Eigen::Vector3d> GroundWithin(const LeveledScan& scan, const Reach& reach) {
  std::vector<Eigen::Vector3d> ground;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (scan.is_ground[i] != 0 && scan.range_m[i] < reach.ahead_m &&
        std::abs(scan.y[i]) < reach.half_width_m) {
      ground.emplace_back(scan.x[i], scan.y[i], scan.z[i]);
    }
  }
  return ground;
}

double Residual(const Eigen::Vector3d& plane, const Eigen::Vector3d& point) {
  return point.z() - (plane.x() * point.x() + plane.y() * point.y() + plane.z());
}

// Weighted least squares, again and again: what lies off the plane (a kerb, the foot of a ramp)
// weighs less from round to round (Geman and McClure's weights).
std::optional<GroundFit> FitGround(std::span<const Eigen::Vector3d> points) {
  constexpr int kRounds = 16;
  constexpr double kFirstScale_m = 1.0;
  constexpr double kLastScale_m = 0.03;  // the sensor's noise
  constexpr double kMinPivot = 1e-3;
  constexpr std::size_t kEnough = 50;
  if (points.size() < kEnough) {
    return std::nullopt;
  }
  GroundFit fit{{0.0, 0.0, MedianHeight(points)}, 0.0};
  double scale_m = kFirstScale_m;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
    double weights = 0.0;
    for (const Eigen::Vector3d& point : points) {
      const double residual = Residual(fit.plane, point);
      const double ratio = residual / scale_m;
      const double weight = 1.0 / ((1.0 + ratio * ratio) * (1.0 + ratio * ratio));
      const Eigen::Vector3d row(point.x(), point.y(), 1.0);
      normal += weight * row * row.transpose();
      moment += weight * residual * row;
      weights += weight;
    }
    const Eigen::LDLT<Eigen::Matrix3d> solver(normal);
    if (solver.vectorD().minCoeff() < kMinPivot * weights) {
      return std::nullopt;  // all in one line
    }
    fit.plane += solver.solve(moment);
    scale_m = std::max(0.7 * scale_m, kLastScale_m);
  }
  double squared = 0.0;
  for (const Eigen::Vector3d& point : points) {
    squared += Residual(fit.plane, point) * Residual(fit.plane, point);
  }
  fit.spread_m = std::sqrt(squared / static_cast<double>(points.size()));
  return fit;
}

}  // namespace

double SensorMount::TiltDeg() const {
  return std::acos(std::clamp(up.z(), -1.0, 1.0)) * 180.0 / std::numbers::pi;
}

Status SensorMount::Validate() const {
  return height_m >= kMinHeight_m && height_m <= kMaxHeight_m
             ? Status()
             : Status(StatusCode::kInvalidArgument,
                      StrCat("sensor height is ", height_m, " m, expected 0.1 to 10"));
}

void SensorMountEstimator::Add(const LeveledScan& scan, const Eigen::Quaterniond& R_level_sensor) {
  std::optional<GroundFit> fit;
  for (std::size_t i = 0; i < kReaches.size() && !fit; ++i) {
    fit = FitGround(GroundWithin(scan, kReaches[i]));
  }
  if (fit) {
    const Eigen::Vector3d up_level(-fit->plane.x(), -fit->plane.y(), 1.0);
    grounds_.push_back(
        {-fit->plane.z(), R_level_sensor.conjugate() * up_level.normalized(), fit->spread_m});
  }
}

Result<SensorMount> SensorMountEstimator::Estimate() const {
  if (grounds_.empty()) {
    return Error(StatusCode::kInvalidData,
                 "no ground within 25 m in any scan: give the sensor's height");
  }
  std::vector<Ground> flattest = grounds_;
  std::stable_sort(flattest.begin(), flattest.end(),
                   [](const Ground& a, const Ground& b) { return a.spread_m < b.spread_m; });
  flattest.resize((flattest.size() + 1) / 2);
  const auto median_of = [&flattest](const auto& value) {
    std::vector<double> values;
    values.reserve(flattest.size());
    for (const Ground& ground : flattest) {
      values.push_back(value(ground));
    }
    return Median(std::move(values));
  };
  SensorMount mount;
  mount.height_m = median_of([](const Ground& ground) { return ground.height_m; });
  mount.up = Eigen::Vector3d(median_of([](const Ground& ground) { return ground.up.x(); }),
                             median_of([](const Ground& ground) { return ground.up.y(); }),
                             median_of([](const Ground& ground) { return ground.up.z(); }))
                 .normalized();
  if (!mount.Validate().ok()) {
    return Error(StatusCode::kInvalidData,
                 StrCat("what looks like ground is ", mount.height_m,
                        " m below the sensor, expected 0.1 to 10: give the sensor's height"));
  }
  return mount;
}

}  // namespace atlas
