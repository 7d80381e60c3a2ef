// What is left to the end of a way, as searches ask for it: straight on, or as a coarser level's
// search found it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "core/planning/surface/surface_tiles.h"

namespace atlas {

// The length of the shortest way on eight directions.
inline double OctileLength(double dx, double dy) {
  const double x = std::abs(dx);
  const double y = std::abs(dy);
  return std::max(x, y) + (std::numbers::sqrt2 - 1.0) * std::min(x, y);
}

// No way along the eight directions is shorter, so it never overestimates.
class StraightAhead {
 public:
  StraightAhead(const SurfaceTiles& tiles, const NodeRef& end)
      : tiles_(tiles),
        end_x_(tiles.CellX(end)),
        end_y_(tiles.CellY(end)),
        end_mm_(tiles.node(end).altitude_mm) {}

  float operator()(const NodeRef& ref) const {
    const double flat_m =
        tiles_.cell_m() * OctileLength(static_cast<double>(tiles_.CellX(ref) - end_x_),
                                       static_cast<double>(tiles_.CellY(ref) - end_y_));
    const double rise_m = 1e-3 * (tiles_.node(ref).altitude_mm - end_mm_);
    return static_cast<float>(std::sqrt(flat_m * flat_m + rise_m * rise_m));
  }

 private:
  const SurfaceTiles& tiles_;
  std::int64_t end_x_;
  std::int64_t end_y_;
  std::int32_t end_mm_;
};

// As a search on a coarser level knows it that began at this one's end: the best way on over the
// middle of one of the nine coarse cells around. Infinite where none of these was closed: outside
// of the corridor.
class GuidedAhead {
 public:
  // `weight` > 1 prefers what is near the end; a route's cost is at most so many times the least.
  GuidedAhead(const SurfaceTiles& tiles, const SurfaceTiles& guide, float weight)
      : tiles_(tiles), guide_(guide), shift_(guide.level() - tiles.level()), weight_(weight) {}

  float operator()(const NodeRef& ref) const;

 private:
  const SurfaceTile* GuideTile(std::uint32_t slot) const;

  const SurfaceTiles& tiles_;
  const SurfaceTiles& guide_;
  int shift_;
  float weight_;
  // Of each tile of the finer level the one above it; null where the guide does not go.
  mutable std::vector<std::optional<const SurfaceTile*>> above_;
};

}  // namespace atlas
