#include "tests/bench/accuracy/accuracy_picture.h"

#include <algorithm>

namespace atlas::testing {
namespace {

constexpr std::int32_t kMaxSide = 4000;

Rgb LayerColor(const DriveMap& map, const MapCell& cell, const CellTruth& truth) {
  if (!IsDecided(truth)) {
    return {90, 90, 90};
  }
  switch (JudgeLayers(map.Layers(cell), truth)) {
    case CellVerdict::kRight:
      return {200, 200, 200};
    case CellVerdict::kMissing:
      return {255, 0, 0};
    case CellVerdict::kFewer:
      return {255, 160, 0};
    case CellVerdict::kMore:
      return {60, 60, 255};
  }
  return {};
}

Rgb ColorOf(const DriveMap& map,
            const MapCell& cell,
            const CellTruth& truth,
            const TruthOptions& options) {
  for (const StructureTruth& structure : truth.structures) {
    if (structure.is_counted(options.min_beams)) {
      const bool is_kept =
          IsOccupied(map, cell, structure.ground_m, options.structure_low_m, options.high_m);
      return is_kept ? Rgb{0, 150, 0} : Rgb{255, 0, 255};
    }
  }
  for (const double ground_m : truth.moving_ground_m) {
    if (!truth.has_low_obstacle &&
        IsOccupied(map, cell, ground_m, options.moving_low_m, options.high_m)) {
      return {0, 220, 220};
    }
  }
  return LayerColor(map, cell, truth);
}

}  // namespace

Image DrawErrors(const DriveMap& map, const TruthMap& truth, const TruthOptions& options) {
  MapCell low{INT32_MAX, INT32_MAX};
  MapCell high{INT32_MIN, INT32_MIN};
  for (const auto& [cell, unused] : truth) {
    low = {std::min(low.x, cell.x), std::min(low.y, cell.y)};
    high = {std::max(high.x, cell.x), std::max(high.y, cell.y)};
  }
  Image image;
  if (truth.empty()) {
    return image;
  }
  image.width = static_cast<std::uint32_t>(std::min(high.x - low.x + 1, kMaxSide));
  image.height = static_cast<std::uint32_t>(std::min(high.y - low.y + 1, kMaxSide));
  image.pixels.resize(std::size_t{image.width} * image.height);
  for (const auto& [cell, cell_truth] : truth) {
    const auto x = static_cast<std::uint32_t>(cell.x - low.x);
    const auto y = static_cast<std::uint32_t>(high.y - cell.y);
    if (x < image.width && y < image.height) {
      image.at(x, y) = ColorOf(map, cell, cell_truth, options);
    }
  }
  return image;
}

}  // namespace atlas::testing
