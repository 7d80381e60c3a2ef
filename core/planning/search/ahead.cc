// The nine coarse cells around a finer one.
#include "core/planning/search/ahead.h"

#include "core/planning/coarse/coarse_map.h"

namespace atlas {

const SurfaceTile* GuidedAhead::GuideTile(std::uint32_t slot) const {
  if (above_.size() <= slot) {
    above_.resize(slot + 1);
  }
  if (!above_[slot]) {
    const TileId& id = tiles_.tile(slot).id;
    const std::int32_t guide = guide_.Find({guide_.level(), id.x >> shift_, id.y >> shift_});
    const bool is_there = guide != SurfaceTile::kNotThere;
    above_[slot] = is_there ? &guide_.tile(static_cast<std::uint32_t>(guide)) : nullptr;
  }
  return *above_[slot];
}

float GuidedAhead::operator()(const NodeRef& ref) const {
  float best = std::numeric_limits<float>::infinity();
  const SurfaceTile* home = GuideTile(ref.slot);
  if (home == nullptr) {
    return best;
  }
  const std::int64_t x = tiles_.CellX(ref);
  const std::int64_t y = tiles_.CellY(ref);
  const std::int64_t guide_x = x >> shift_;
  const std::int64_t guide_y = y >> shift_;
  // From the finer cell's middle to that of the coarse one, in finer cells.
  const double middle = 0.5 * static_cast<double>((std::int64_t{1} << shift_) - 1);
  const double to_x = static_cast<double>((guide_x << shift_) - x) + middle;
  const double to_y = static_cast<double>((guide_y << shift_) - y) + middle;
  const auto step = static_cast<double>(std::int64_t{1} << shift_);
  const std::int32_t altitude_mm = tiles_.node(ref).altitude_mm;
  for (std::int32_t dy = -1; dy <= 1; ++dy) {
    for (std::int32_t dx = -1; dx <= 1; ++dx) {
      const CellNodes cell =
          guide_.Cell(*home, static_cast<std::int32_t>(guide_x - home->origin_x) + dx,
                      static_cast<std::int32_t>(guide_y - home->origin_y) + dy);
      const NodeRef node = guide_.Nearest(cell, altitude_mm, CoarseMap::kSameSurface_mm);
      if (node.is_none() || !guide_.node(node).Has(SurfaceNode::kCorridor)) {
        continue;
      }
      const double flat_m = tiles_.cell_m() * OctileLength(to_x + dx * step, to_y + dy * step);
      best = std::min(best, static_cast<float>(flat_m) + guide_.cost(node));
    }
  }
  return weight_ * best;
}

}  // namespace atlas
