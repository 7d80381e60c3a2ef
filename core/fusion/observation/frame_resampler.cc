#include "core/fusion/observation/frame_resampler.h"

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
      level_mm_(static_cast<std::int32_t>(RoundDiv(placement_.z_um, 1000))),
      level_lattice_(NearestLattice(level_mm_)) {
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

std::size_t FrameResampler::FindPlaces(const TileBand& band, std::int32_t y, Row& row) const {
  constexpr int kShift = kFineBits - kCoarseBits;
  const std::int64_t first_i = std::int64_t{band.id.x} * tile_cells_;
  const std::int64_t j = std::int64_t{band.id.y} * tile_cells_ + band.first_row + y;
  const RowSpan span = DiscSpan(j, first_i, tile_cells_);
  const std::int64_t cos = placement_.cos_yaw;
  const std::int64_t sin = placement_.sin_yaw;
  // The centre of cell (i, j) is at (2 i + 1, 2 j + 1) half cells.
  std::int64_t u = cos * (2 * span.begin + 1) + sin * (2 * j + 1) - u_origin_;
  std::int64_t v = cos * (2 * j + 1) - sin * (2 * span.begin + 1) - v_origin_;
  auto cell = static_cast<std::uint32_t>(std::int64_t{y} * tile_cells_ + span.begin - first_i);
  std::size_t count = 0;
  for (std::int64_t i = span.begin; i < span.end; ++i) {
    const std::int64_t u_q16 = u >> kShift;
    const std::int64_t v_q16 = v >> kShift;
    const std::int64_t squared_q32 = u_q16 * u_q16 + v_q16 * v_q16;
    const auto ix = static_cast<std::int32_t>(u_q16 >> kCoarseBits);
    const auto iy = static_cast<std::int32_t>(v_q16 >> kCoarseBits);
    if (squared_q32 < limit_q32_) {
      row[count++] = {cell, static_cast<std::uint32_t>(keyframe_.grid.Index(ix, iy)),
                      static_cast<std::uint32_t>(squared_q32 >> (2 * kCoarseBits)),
                      static_cast<std::int16_t>(ix), static_cast<std::int16_t>(iy)};
    }
    ++cell;
    u += 2 * cos;
    v -= 2 * sin;
  }
  return count;
}

}  // namespace atlas
