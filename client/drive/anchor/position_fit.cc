#include "client/drive/anchor/position_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "client/drive/anchor/frame_fit.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

double Median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

PlacePrior PriorOf(const KnownPlace& place) {
  constexpr double kSigmas = 3.0;
  constexpr double kBeside_m = 1.0;
  constexpr double kMost_m = 1e5;  // a prior has no larger one
  const double reach_m = std::min(kSigmas * place.radius_m + kBeside_m, kMost_m);
  PlacePrior prior;
  prior.center = place.p_world.head<2>();
  prior.radius_m = reach_m;
  prior.z_m = place.p_world.z();
  prior.height_m = reach_m;
  return prior;
}

PositionFit FitPositions(std::span<const DriveScan* const> scans,
                         const KnownPlaces& positions,
                         const LevelTransform& T_map_drive) {
  const Pose T = T_map_drive.ToPose();
  std::array<std::vector<double>, 3> off_m;
  std::vector<double> radii_m;
  for (const DriveScan* scan : scans) {
    const auto place = positions.find(scan->number);
    if (place == positions.end()) continue;
    const Eigen::Vector3d off = T * scan->T_world_sensor.translation() - place->second.p_world;
    for (int axis = 0; axis < 3; ++axis) off_m[static_cast<std::size_t>(axis)].push_back(off(axis));
    radii_m.push_back(place->second.radius_m);
  }
  PositionFit fit;
  fit.positions = radii_m.size();
  if (radii_m.empty()) return fit;
  for (int axis = 0; axis < 3; ++axis) {
    fit.off_m(axis) = Median(std::move(off_m[static_cast<std::size_t>(axis)]));
  }
  fit.radius_m = Median(std::move(radii_m));
  return fit;
}

std::string WhyOff(const PositionFit& fit) {
  if (fit.positions == 0) return {};
  const double allowed_m = 2.0 * fit.radius_m + 0.5;
  const double aside_m = fit.off_m.head<2>().norm();
  const double up_m = std::abs(fit.off_m.z());
  if (aside_m <= allowed_m && up_m <= allowed_m) return {};
  return StrCat("the drive is found ", InThousandths(aside_m), " m beside its positions and ",
                InThousandths(fit.off_m.z()), " m above them, by the median of ", fit.positions,
                ", expected at most ", InThousandths(allowed_m),
                " m, for they are said to be right to ", InThousandths(fit.radius_m), " m");
}

}  // namespace atlas
