#include "core/localization/icp/point_icp.h"

#include <cmath>

namespace atlas {
namespace {

struct Pairs {
  Eigen::Matrix3Xd scan;  // as moved so far
  Eigen::Matrix3Xd map;
  Eigen::Index count = 0;
  double square_sum_m2 = 0.0;
};

void FindPairs(const PointIndex& map,
               const std::vector<Eigen::Vector3f>& scan,
               const Pose& T_map_scan,
               float reach_m,
               Pairs& pairs) {
  pairs.count = 0;
  pairs.square_sum_m2 = 0.0;
  for (const Eigen::Vector3f& point : scan) {
    const Eigen::Vector3d moved = T_map_scan * point.cast<double>();
    const std::optional<NearPoint> near = map.Nearest(moved.cast<float>(), reach_m);
    if (!near) continue;
    pairs.scan.col(pairs.count) = moved;
    pairs.map.col(pairs.count) = map.points()[near->index].cast<double>();
    pairs.square_sum_m2 += double{near->distance_m} * near->distance_m;
    ++pairs.count;
  }
}

// The motion that takes one side of the pairs to the other (Umeyama 1991, without scale).
Pose BestMotion(const Pairs& pairs) {
  return Pose(
      Eigen::umeyama(pairs.scan.leftCols(pairs.count), pairs.map.leftCols(pairs.count), false));
}

}  // namespace

PointIcpResult AlignPoints(const PointIndex& map,
                           const std::vector<Eigen::Vector3f>& scan,
                           const Pose& T_map_scan,
                           const PointIcpOptions& options) {
  PointIcpResult result;
  result.T_map_scan = T_map_scan;
  const auto size = static_cast<Eigen::Index>(scan.size());
  Pairs pairs{Eigen::Matrix3Xd(3, size), Eigen::Matrix3Xd(3, size)};
  while (result.iterations < options.max_iterations && !result.is_converged) {
    FindPairs(map, scan, result.T_map_scan, options.reach_m, pairs);
    result.pairs = static_cast<std::size_t>(pairs.count);
    if (result.pairs < options.min_pairs) return result;
    result.rmse_m = std::sqrt(pairs.square_sum_m2 / static_cast<double>(pairs.count));
    const Pose step = BestMotion(pairs);
    const Eigen::Vector3d moved_m =
        step * result.T_map_scan.translation() - result.T_map_scan.translation();
    result.T_map_scan = step * result.T_map_scan;
    ++result.iterations;
    const double turned_rad = Eigen::AngleAxisd(step.linear()).angle();
    result.is_converged =
        moved_m.norm() < options.converged_m && turned_rad < options.converged_rad;
  }
  return result;
}

}  // namespace atlas
