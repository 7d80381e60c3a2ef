#include "tests/bench/follow/route_places.h"

#include "core/scan/drive_folder.h"

namespace atlas::testing {

Result<std::vector<Eigen::Vector3d>> PlacesAlong(const std::filesystem::path& poses,
                                                 double spacing_m) {
  const auto path = ReadPoses(poses);
  if (!path) return Error(path.error());
  std::vector<Eigen::Vector3d> places;
  double next_m = 0.0;
  double driven_m = 0.0;
  for (std::size_t i = 1; i < path->size(); ++i) {
    const Eigen::Vector3d from = (*path)[i - 1].translation();
    const Eigen::Vector3d step = (*path)[i].translation() - from;
    const double length_m = step.norm();
    for (; next_m < driven_m + length_m; next_m += spacing_m) {
      places.emplace_back(from + (next_m - driven_m) / length_m * step);
    }
    driven_m += length_m;
  }
  return places;
}

}  // namespace atlas::testing
