#include "core/fusion/frame_resampler.h"

namespace atlas {
namespace {

// round(2 (x a + y b) / cell size): a rotated position in cells x 2^31.
std::int64_t RotatedOrigin(const KeyframePlacement& p,
                           std::int64_t a,
                           std::int64_t b,
                           std::int64_t cell_size_um) {
  return RoundDiv128(2 * (Int128{p.x_um} * a + Int128{p.y_um} * b), cell_size_um);
}

std::uint64_t ColumnMask(const MapProfile& profile) {
  return ~std::uint64_t{0} >> (64u - 4u * profile.column_segments);
}

}  // namespace

FrameResampler::FrameResampler(const FrameOnMap& frame,
                               const Keyframe& keyframe,
                               const SigmaTable& sigmas,
                               const MapProfile& profile)
    : keyframe_(keyframe),
      sigmas_(sigmas),
      placement_(frame.placement),
      cell_size_um_(profile.cell_size_um),
      segment_height_mm_(profile.segment_height_mm),
      tile_cells_(profile.tile_cells),
      column_mask_(ColumnMask(profile)),
      u_origin_(RotatedOrigin(placement_, placement_.cos_yaw, placement_.sin_yaw, cell_size_um_)),
      v_origin_(RotatedOrigin(
          placement_, -std::int64_t{placement_.sin_yaw}, placement_.cos_yaw, cell_size_um_)),
      is_level_(placement_.slope_x == 0 && placement_.slope_y == 0),
      level_lattice_(NearestLattice(static_cast<std::int32_t>(RoundDiv(placement_.z_um, 1000)))) {
  const std::int64_t radius_q16 = std::int64_t{frame.grid.radius_cells} << kCoarseBits;
  limit_q32_ = radius_q16 * radius_q16;
}

// A cell more on either side than the disc can reach: what is inside is decided cell by cell.
FrameResampler::RowSpan FrameResampler::DiscSpan(std::int64_t j,
                                                 std::int64_t first_i,
                                                 std::int64_t cells) const {
  const std::int64_t end_i = first_i + cells;
  const std::int64_t radius_um = std::int64_t{keyframe_.grid.radius_cells} * cell_size_um_;
  const std::int64_t dy_um = (2 * j + 1) * cell_size_um_ / 2 - placement_.y_um;
  if (dy_um > radius_um + cell_size_um_ || dy_um < -radius_um - cell_size_um_) {
    return {first_i, first_i};
  }
  const std::int64_t half_um = static_cast<std::int64_t>(Isqrt(static_cast<std::uint64_t>(
      std::max<std::int64_t>(0, radius_um * radius_um - dy_um * dy_um))));
  const std::int64_t begin = FloorDiv(placement_.x_um - half_um, cell_size_um_) - 1;
  const std::int64_t end = FloorDiv(placement_.x_um + half_um, cell_size_um_) + 2;
  return {std::clamp(begin, first_i, end_i), std::clamp(end, first_i, end_i)};
}

}  // namespace atlas
