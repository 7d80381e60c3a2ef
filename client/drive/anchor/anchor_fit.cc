#include "client/drive/anchor/anchor_fit.h"

#include <algorithm>
#include <cmath>

namespace atlas {
namespace {

constexpr double kPlaceSigma_m = 0.05;
constexpr double kHeadingSigma_rad = 0.1 * std::numbers::pi / 180.0;
constexpr int kIterations = 20;

double Wrapped(double angle_rad) {
  return std::remainder(angle_rad, 2.0 * std::numbers::pi);
}

Eigen::Matrix3d TurnOf(double yaw_rad) {
  return Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

// How much the heading of the one is turned against that of the other.
double YawBetween(const Pose& T_to_sensor, const Pose& T_from_sensor) {
  return SplitYaw(Eigen::Quaterniond(T_to_sensor.linear() * T_from_sensor.linear().transpose()))
      .yaw_rad;
}

// One step of weighted least squares from `before`, which is near.
LevelTransform Step(std::span<const FoundScan> found,
                    std::span<const double> weights,
                    const LevelTransform& before) {
  double sum = 0.0;
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  Eigen::Vector3d to = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < found.size(); ++i) {
    sum += weights[i];
    from += weights[i] * found[i].T_drive_sensor.translation();
    to += weights[i] * found[i].T_map_sensor.translation();
  }
  from /= sum;
  to /= sum;
  const Eigen::Matrix3d turn = TurnOf(before.yaw_rad);
  double gradient = 0.0;
  double information = 0.0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Eigen::Vector3d p = turn * (found[i].T_drive_sensor.translation() - from);
    const Eigen::Vector3d q = found[i].T_map_sensor.translation() - to;
    const double place = weights[i] / (kPlaceSigma_m * kPlaceSigma_m);
    const double heading = weights[i] / (kHeadingSigma_rad * kHeadingSigma_rad);
    gradient += place * (p.x() * q.y() - p.y() * q.x());
    information += place * p.head<2>().squaredNorm();
    gradient += heading * OffsetFrom(before, found[i]).yaw_rad;
    information += heading;
  }
  LevelTransform after;
  after.yaw_rad = Wrapped(before.yaw_rad + gradient / information);
  after.shift_m = to - TurnOf(after.yaw_rad) * from;
  return after;
}

// Geman-McClure, of the place alone; as wide as the scans are off, so that none rules.
std::vector<double> WeightsOf(std::span<const FoundScan> found, const LevelTransform& T_map_drive) {
  std::vector<double> off_m;
  for (const FoundScan& scan : found) {
    off_m.push_back(OffsetFrom(T_map_drive, scan).place_m.norm());
  }
  std::vector<double> sorted = off_m;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  const double width_m = std::max(3.0 * *middle, kPlaceSigma_m);
  std::vector<double> weights;
  for (const double off : off_m) {
    const double share = 1.0 / (1.0 + (off / width_m) * (off / width_m));
    weights.push_back(share * share);
  }
  return weights;
}

}  // namespace

Pose LevelTransform::ToPose() const {
  Pose pose = Pose::Identity();
  pose.linear() = TurnOf(yaw_rad);
  pose.translation() = shift_m;
  return pose;
}

LevelTransform LevelTransformBetween(const Pose& T_to_sensor, const Pose& T_from_sensor) {
  LevelTransform transform;
  transform.yaw_rad = YawBetween(T_to_sensor, T_from_sensor);
  transform.shift_m =
      T_to_sensor.translation() - TurnOf(transform.yaw_rad) * T_from_sensor.translation();
  return transform;
}

bool Agree(const FoundScan& a, const FoundScan& b, const AgreementOptions& options) {
  const LevelTransform of_a = LevelTransformBetween(a.T_map_sensor, a.T_drive_sensor);
  const LevelTransform of_b = LevelTransformBetween(b.T_map_sensor, b.T_drive_sensor);
  const double way_m = (a.T_drive_sensor.translation() - b.T_drive_sensor.translation()).norm();
  const double most_m = options.distance_m + options.drift * way_m;
  return std::abs(Wrapped(of_a.yaw_rad - of_b.yaw_rad)) <= options.yaw_rad &&
         OffsetFrom(of_a, b).place_m.norm() <= most_m &&
         OffsetFrom(of_b, a).place_m.norm() <= most_m;
}

std::vector<std::size_t> LargestAgreement(std::span<const FoundScan> found,
                                          const AgreementOptions& options) {
  std::vector<std::size_t> largest;
  for (const FoundScan& one : found) {
    std::vector<std::size_t> agreeing;
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (Agree(one, found[i], options)) agreeing.push_back(i);
    }
    if (agreeing.size() > largest.size()) largest = std::move(agreeing);
  }
  return largest;
}

FrameOffset OffsetFrom(const LevelTransform& T_map_drive, const FoundScan& scan) {
  const Pose T_map_expected = T_map_drive.ToPose() * scan.T_drive_sensor;
  const Eigen::AngleAxisd turn(T_map_expected.linear().transpose() * scan.T_map_sensor.linear());
  return {scan.T_map_sensor.translation() - T_map_expected.translation(),
          Wrapped(YawBetween(scan.T_map_sensor, scan.T_drive_sensor) - T_map_drive.yaw_rad),
          std::abs(Wrapped(turn.angle()))};
}

LevelTransform FitTransform(std::span<const FoundScan> found) {
  LevelTransform T_map_drive =
      LevelTransformBetween(found.front().T_map_sensor, found.front().T_drive_sensor);
  const std::vector<double> even(found.size(), 1.0);
  T_map_drive = Step(found, even, T_map_drive);
  for (int i = 0; i < kIterations; ++i) {
    T_map_drive = Step(found, WeightsOf(found, T_map_drive), T_map_drive);
  }
  return T_map_drive;
}

}  // namespace atlas
