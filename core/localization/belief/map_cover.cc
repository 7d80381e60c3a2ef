#include "core/localization/belief/map_cover.h"

#include <cstddef>
#include <optional>

namespace atlas {

std::string_view MapCoverName(MapCover cover) {
  switch (cover) {
    case MapCover::kNone:
      return "none";
    case MapCover::kCoarse:
      return "coarse";
    case MapCover::kFine:
      return "fine";
  }
  return "none";
}

CoverAtScan CoverAt(const MapWindow& map,
                    const ScanFeatures& features,
                    const Pose& T_world_level,
                    double cell_size_m) {
  constexpr std::size_t kStride = 4;
  constexpr double kMapped = 0.05;  // of the ground: less is the edge of a map elsewhere
  const Eigen::Matrix3f R = T_world_level.linear().cast<float>();
  const Eigen::Vector3f t = (T_world_level.translation() - map.origin()).cast<float>();
  int looked_at = 0;
  int mapped = 0;
  int fine = 0;
  double cells_m = 0.0;
  for (std::size_t i = 0; i < features.ground.size(); i += kStride) {
    const std::optional<int> level = map.LevelAt(R * features.ground[i] + t);
    ++looked_at;
    mapped += level ? 1 : 0;
    fine += level == 0 ? 1 : 0;
    cells_m += level ? cell_size_m * (1 << *level) : 0.0;
  }
  if (mapped == 0 || mapped < kMapped * looked_at) {
    return {MapCover::kNone, cell_size_m};
  }
  return {2 * fine >= mapped ? MapCover::kFine : MapCover::kCoarse, cells_m / mapped};
}

}  // namespace atlas
