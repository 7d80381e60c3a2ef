// What is drivable: free of obstacles within the vehicle's half width, and the plane fitted around
// it not too steep.
#include "core/planning/surface/surface_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/planning/surface/plane_fit.h"

namespace atlas {
namespace {

// A sample beyond a step and this much slope belongs to another surface.
constexpr double kSameSurfaceSlope = 0.7;
// Slope is sampled no denser than this: closer cells share their noise.
constexpr double kSlopeSampleStep_m = 0.2;

}  // namespace

SurfaceMap::SurfaceMap(TileSource& source,
                       const MapProfile& profile,
                       const PlanOptions& options,
                       PlanBudget& budget)
    : options_(options),
      tiles_(source, profile, options, budget, 0),
      clearance_(tiles_, options),
      max_cells_(1 + static_cast<std::int32_t>(options.max_gap_m / profile.cell_size_m() + 1e-9)),
      max_step_mm_(static_cast<std::int32_t>(std::lround(options.max_step_m * 1e3))),
      max_gradient_(std::tan(options.max_slope_deg * std::numbers::pi / 180.0) *
                    profile.cell_size_m()) {
  FillCosts();
  FillSlopeSamples();
}

void SurfaceMap::FillCosts() {
  for (std::size_t i = 0; i < cost_of_metre_.size(); ++i) {
    const double spare_m = clearance_.Metres(static_cast<std::uint8_t>(i)) - options_.inflation_m();
    const double crowding =
        options_.comfort_m > 0.0 ? std::clamp(1.0 - spare_m / options_.comfort_m, 0.0, 1.0) : 0.0;
    cost_of_metre_[i] = static_cast<float>(1.0 + options_.comfort_weight * crowding);
  }
}

void SurfaceMap::FillSlopeSamples() {
  const double cell_m = tiles_.cell_m();
  const double step_m = std::min(kSlopeSampleStep_m, options_.slope_radius_m);
  const auto step = std::max(1, static_cast<std::int32_t>(std::lround(step_m / cell_m)));
  const auto steps = static_cast<std::int32_t>(options_.slope_radius_m / cell_m) / step;
  for (std::int32_t y = -steps; y <= steps; ++y) {
    for (std::int32_t x = -steps; x <= steps; ++x) {
      const double distance_m = std::hypot(x, y) * step * cell_m;
      if (distance_m <= options_.slope_radius_m) {
        const double limit_m = options_.max_step_m + kSameSurfaceSlope * distance_m;
        slope_samples_.push_back(
            {x * step, y * step, static_cast<std::int32_t>(std::lround(limit_m * 1e3))});
      }
    }
  }
}

// Metres per cell; none where too little of the surface is known. The plane is fitted to what is
// measured and free.
std::optional<double> SurfaceMap::Gradient(const SurfaceTile& home, const SurfaceNode& node) const {
  PlaneFit fit;
  std::size_t known = 0;
  const std::int32_t x = node.cell % tiles_.side();
  const std::int32_t y = node.cell / tiles_.side();
  for (const SlopeSample& sample : slope_samples_) {
    const NodeRef other = tiles_.Nearest(tiles_.Cell(home, x + sample.dx, y + sample.dy),
                                         node.altitude_mm, sample.height_limit_mm + 1);
    if (other.is_none()) {
      continue;
    }
    ++known;
    const SurfaceNode& there = tiles_.node(other);
    if (there.Has(SurfaceNode::kMeasured) && !there.Has(SurfaceNode::kObstacle)) {
      fit.Add(sample.dx, sample.dy, 1e-3 * (there.altitude_mm - node.altitude_mm));
    }
  }
  const double support = static_cast<double>(known) / static_cast<double>(slope_samples_.size());
  return support >= options_.min_support ? fit.Gradient() : std::nullopt;
}

std::optional<double> SurfaceMap::Slope(const NodeRef& ref) const {
  const auto gradient = Gradient(tiles_.tile(ref.slot), tiles_.node(ref));
  return gradient ? std::optional(*gradient / tiles_.cell_m()) : std::nullopt;
}

Status SurfaceMap::Analyse(const NodeRef& ref) {
  ATLAS_RETURN_IF_ERROR(tiles_.Join(ref));
  SurfaceNode& node = tiles_.node(ref);
  if (!node.Has(SurfaceNode::kAnalysed)) {
    node.flags |= SurfaceNode::kAnalysed;
    Judge(ref);
  }
  return {};
}

void SurfaceMap::Judge(const NodeRef& ref) {
  SurfaceNode& node = tiles_.node(ref);
  if (!node.Has(SurfaceNode::kOpen)) {
    return;
  }
  node.clearance = clearance_.Of(ref);
  if (node.clearance != SurfaceNode::kFar &&
      clearance_.Metres(node.clearance) <= options_.inflation_m()) {
    return;
  }
  const auto gradient = Gradient(tiles_.tile(ref.slot), node);
  if (gradient && *gradient <= max_gradient_) {
    node.flags |= SurfaceNode::kDrivable;
  }
}

}  // namespace atlas
