#include "tests/bench/localization/raw_icp.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_set>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "core/scan/range_image.h"
#include "core/scan/scan_reader.h"

namespace atlas::testing {
namespace {

// Sensor frame, without the vehicle itself.
std::vector<Eigen::Vector3f> ReturnsOf(const PointCloud& cloud,
                                       const DriveSurvey& survey,
                                       float max_range_m) {
  const RangeImage image = MakeRangeImage(cloud, survey.layout, survey.ring_step);
  std::vector<Eigen::Vector3f> points;
  for (std::size_t i = 0; i < image.size(); ++i) {
    const Eigen::Vector3f p(image.x[i], image.y[i], image.z[i]);
    if (p.head<2>().norm() <= max_range_m) points.push_back(p);
  }
  return points;
}

std::vector<Eigen::Vector3f> OnePerVoxel(const std::vector<Eigen::Vector3f>& points, float side_m) {
  const auto index = [side_m](float v) {
    return static_cast<std::uint64_t>(std::floor(v / side_m) + (1 << 20));
  };
  std::unordered_set<std::uint64_t> taken;
  std::vector<Eigen::Vector3f> kept;
  for (const Eigen::Vector3f& p : points) {
    if (taken.insert(index(p.x()) << 42 | index(p.y()) << 21 | index(p.z())).second) {
      kept.push_back(p);
    }
  }
  return kept;
}

Eigen::Vector3f NormalAt(const PointIndex& index,
                         const Eigen::Vector3f& p,
                         const RawIcpOptions& options,
                         std::vector<NearPoint>& near) {
  constexpr std::size_t kLeast = 5;
  index.Nearest(p, options.normal_reach_m, options.normal_points, near);
  if (near.size() < kLeast) return Eigen::Vector3f::Zero();
  Eigen::Vector3f mean = Eigen::Vector3f::Zero();
  for (const NearPoint& neighbour : near) mean += index.points()[neighbour.index];
  mean /= static_cast<float>(near.size());
  Eigen::Matrix3f spread = Eigen::Matrix3f::Zero();
  for (const NearPoint& neighbour : near) {
    const Eigen::Vector3f d = index.points()[neighbour.index] - mean;
    spread += d * d.transpose();
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver;
  solver.computeDirect(spread);
  const Eigen::Vector3f& variances = solver.eigenvalues();
  const float thin = options.max_thickness * options.max_thickness;
  // Returns of one ring lie on a line and have a middle variance of nearly nothing.
  const bool is_plane = variances(0) < thin * variances(1) && variances(1) > 0.01F * variances(2);
  return is_plane ? Eigen::Vector3f(solver.eigenvectors().col(0)) : Eigen::Vector3f::Zero();
}

}  // namespace

struct RawIcp::Equations {
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> pull = Eigen::Matrix<double, 6, 1>::Zero();
  int pairs = 0;
};

RawIcp::RawIcp(const DriveSurvey& survey,
               const RawIcpOptions& options,
               const Eigen::Vector3d& origin,
               std::vector<Eigen::Vector3f> points)
    : survey_(survey), options_(options), origin_(origin), map_(std::move(points)) {
  std::vector<NearPoint> near;
  for (const Eigen::Vector3f& p : map_.points()) {
    normals_.push_back(NormalAt(map_, p, options_, near));
  }
}

Result<std::unique_ptr<RawIcp>> RawIcp::Make(const DriveFolder& drive,
                                             const DriveSurvey& survey,
                                             const SelectionOptions& selection,
                                             const RawIcpOptions& options) {
  const Eigen::Vector3d origin = drive.scans.front().T_world_sensor.translation();
  std::vector<Eigen::Vector3f> points;
  for (const SelectedScan& selected : SelectScans(drive, selection)) {
    const DriveScan& scan = drive.scans[selected.index];
    const auto cloud = ReadScan(scan.scan);
    if (!cloud) return Error(cloud.error());
    for (const Eigen::Vector3f& p : ReturnsOf(*cloud, survey, options.max_range_m)) {
      points.push_back((scan.T_world_sensor * p.cast<double>() - origin).cast<float>());
    }
  }
  return std::unique_ptr<RawIcp>(new RawIcp(survey, options, origin, std::move(points)));
}

RawIcp::Equations RawIcp::Linearize(const std::vector<Eigen::Vector3f>& scan,
                                    const Pose& T_map_sensor,
                                    float reach_m) const {
  Equations equations;
  const double kernel_m = std::max(options_.min_kernel_m, options_.kernel_share * reach_m);
  const double kernel2 = kernel_m * kernel_m;
  for (const Eigen::Vector3f& point : scan) {
    const Eigen::Vector3d p = T_map_sensor * point.cast<double>();
    const auto near = map_.Nearest(p.cast<float>(), reach_m);
    if (!near || normals_[near->index].isZero()) continue;
    const Eigen::Vector3d normal = normals_[near->index].cast<double>();
    const double off_m = normal.dot(p - map_.points()[near->index].cast<double>());
    const double root = kernel2 / (kernel2 + off_m * off_m);
    Eigen::Matrix<double, 6, 1> J;
    J << normal, (p - T_map_sensor.translation()).cross(normal);
    equations.information += root * root * J * J.transpose();
    equations.pull -= root * root * off_m * J;
    ++equations.pairs;
  }
  return equations;
}

Result<LocatedScan> RawIcp::Locate(const PointCloud& cloud,
                                   const Eigen::Quaterniond& /*R_level_sensor*/,
                                   double /*scans*/) {
  constexpr int kMinPairs = 50;
  const std::vector<Eigen::Vector3f> scan =
      OnePerVoxel(ReturnsOf(cloud, survey_, options_.max_range_m), options_.voxel_m);
  LocatedScan located;
  Pose T_map_sensor = T_world_sensor_;
  T_map_sensor.translation() -= origin_;
  float reach_m = options_.coarse_reach_m;
  for (int i = 0; i < options_.max_iterations; ++i) {
    const Equations equations = Linearize(scan, T_map_sensor, reach_m);
    if (equations.pairs < kMinPairs) return located;
    const Eigen::Matrix<double, 6, 1> step = equations.information.ldlt().solve(equations.pull);
    const Eigen::Vector3d turn = step.tail<3>();
    if (turn.norm() > 0.0) {
      T_map_sensor.linear() =
          Eigen::AngleAxisd(turn.norm(), turn.normalized()) * T_map_sensor.linear();
    }
    T_map_sensor.translation() += step.head<3>();
    located.fit = static_cast<double>(equations.pairs) / static_cast<double>(scan.size());
    const bool is_still =
        step.head<3>().norm() < options_.converged_m && turn.norm() < options_.converged_rad;
    if (is_still && reach_m <= options_.fine_reach_m) break;
    reach_m = std::max(0.7F * reach_m, options_.fine_reach_m);
  }
  located.T_world_sensor = T_map_sensor;
  located.T_world_sensor.translation() += origin_;
  located.health = LocalizationHealth::kGood;
  T_world_sensor_ = located.T_world_sensor;
  return located;
}

}  // namespace atlas::testing
