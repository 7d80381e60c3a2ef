// Discs stamped around the rims of obstacles.
#include "core/planning/obstacle_inflation.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace atlas {
namespace {

// Surfaces differ in height by no more than this per metre across, be it on the steepest ramp.
constexpr double kSameSurfaceSlope = 0.7;
// An obstacle's altitude is that of the ground near it, known to about this much.
constexpr std::int32_t kHeightSlack_mm = 300;
constexpr double kClearanceSteps = 250.0;
constexpr std::int64_t kHighest_mm = 100'000;

}  // namespace

ObstacleInflation::ObstacleInflation(const MapProfile& profile, const PlanOptions& options)
    : reach_m_(options.clearance_reach_m()),
      reach_cells_(static_cast<std::int32_t>(reach_m_ / profile.cell_size_m())),
      side_(profile.tile_cells) {
  for (std::int32_t dy = -reach_cells_; dy <= reach_cells_; ++dy) {
    for (std::int32_t dx = -reach_cells_; dx <= reach_cells_; ++dx) {
      const double distance_m = std::hypot(dx, dy) * profile.cell_size_m();
      if (distance_m > reach_m_) {
        continue;
      }
      const double steps = reach_m_ > 0.0 ? kClearanceSteps * distance_m / reach_m_ : 0.0;
      const auto rise_mm =
          static_cast<std::int32_t>(std::lround(1e3 * kSameSurfaceSlope * distance_m));
      offsets_.push_back(
          {dx, dy, kHeightSlack_mm + rise_mm, static_cast<std::uint8_t>(std::lround(steps))});
    }
  }
}

double ObstacleInflation::Clearance(const SurfaceNode& node) const {
  return node.clearance == SurfaceNode::kFar ? reach_m_
                                             : reach_m_ * node.clearance / kClearanceSteps;
}

void ObstacleInflation::Inflate(SurfaceTile& tile,
                                const std::array<const SurfaceTile*, 9>& around) const {
  const auto is_within_reach = [this](std::int32_t v) {
    return v >= -reach_cells_ && v < side_ + reach_cells_;
  };
  for (std::size_t i = 0; i < around.size(); ++i) {
    if (around[i] == nullptr) {
      continue;
    }
    const std::int32_t shift_x = (static_cast<std::int32_t>(i % 3) - 1) * side_;
    const std::int32_t shift_y = (static_cast<std::int32_t>(i / 3) - 1) * side_;
    for (const SurfaceNode& node : around[i]->nodes) {
      const std::int32_t x = shift_x + node.cell % side_;
      const std::int32_t y = shift_y + node.cell / side_;
      if (node.Has(SurfaceNode::kObstacle) && is_within_reach(x) && is_within_reach(y) &&
          !IsInside(*around[i], node)) {
        StampDisc(tile, x, y, BandOf(*around[i], node));
      }
    }
  }
}

ObstacleInflation::HeightBand ObstacleInflation::BandOf(const SurfaceTile& tile,
                                                        const SurfaceNode& node) {
  const std::int64_t altitude_mm = node.altitude_mm;
  HeightBand band{altitude_mm, altitude_mm - kHighest_mm, altitude_mm + kHighest_mm};
  for (const SurfaceNode& other : tile.Nodes(node.cell)) {
    const std::int64_t middle_mm = (altitude_mm + other.altitude_mm) / 2;
    if (other.altitude_mm > altitude_mm) {
      band.high_mm = std::min(band.high_mm, middle_mm);
    } else if (other.altitude_mm < altitude_mm) {
      band.low_mm = std::max(band.low_mm, middle_mm);
    }
  }
  return band;
}

// Obstacles on all four sides: the disc around it lies in theirs.
bool ObstacleInflation::IsInside(const SurfaceTile& tile, const SurfaceNode& node) const {
  const std::int32_t x = node.cell % side_;
  const std::int32_t y = node.cell / side_;
  if (x == 0 || y == 0 || x == side_ - 1 || y == side_ - 1) {
    return false;
  }
  const std::array<std::int32_t, 4> steps = {-1, 1, -side_, side_};
  return std::all_of(steps.begin(), steps.end(), [&](std::int32_t step) {
    const auto beside = tile.Nodes(static_cast<std::uint32_t>(node.cell + step));
    return std::any_of(beside.begin(), beside.end(), [&](const SurfaceNode& other) {
      return other.Has(SurfaceNode::kObstacle) &&
             std::abs(std::int64_t{other.altitude_mm} - node.altitude_mm) <= kHeightSlack_mm;
    });
  });
}

void ObstacleInflation::StampDisc(SurfaceTile& tile,
                                  std::int32_t x,
                                  std::int32_t y,
                                  const HeightBand& band) const {
  for (const Offset& offset : offsets_) {
    const std::int32_t cx = x + offset.dx;
    const std::int32_t cy = y + offset.dy;
    if (cx < 0 || cy < 0 || cx >= side_ || cy >= side_) {
      continue;
    }
    for (SurfaceNode& node : tile.Nodes(static_cast<std::uint32_t>(cy * side_ + cx))) {
      const std::int64_t height_mm = node.altitude_mm;
      if (std::abs(height_mm - band.altitude_mm) <= offset.height_limit_mm &&
          height_mm >= band.low_mm && height_mm <= band.high_mm) {
        node.clearance = std::min(node.clearance, offset.clearance);
      }
    }
  }
}

}  // namespace atlas
