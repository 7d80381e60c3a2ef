#include "core/fusion/block_gatherer.h"

#include "core/base/integer_math.h"

namespace atlas {
namespace {

constexpr int kFineBits = 31;    // of u and v, in cells
constexpr int kCoarseBits = 16;  // enough for distances, and their squares fit in 64 bits

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

// The lattice index nearest to a sensor's altitude, remembered while the altitude stays near it.
class BlockGatherer::ColumnLattice {
 public:
  explicit ColumnLattice(std::int32_t segment_height_mm) : height_mm_(segment_height_mm) {}

  std::int32_t NearestIndex(std::int32_t z_mm) {
    if (z_mm < begin_mm_ || z_mm >= end_mm_) {
      const std::int64_t index = RoundDiv(z_mm, height_mm_);
      index_ = static_cast<std::int32_t>(index);
      begin_mm_ = index * height_mm_ - height_mm_ / 2;
      end_mm_ = begin_mm_ + height_mm_;
    }
    return index_;
  }

 private:
  std::int64_t height_mm_;
  std::int32_t index_ = 0;
  std::int64_t begin_mm_ = 0;
  std::int64_t end_mm_ = 0;
};

BlockGatherer::BlockGatherer(const TileId& id,
                             const FusionInput& input,
                             const SigmaTable& sigmas,
                             const MapProfile& profile)
    : input_(input),
      sigmas_(sigmas),
      cell_size_um_(profile.cell_size_um),
      segment_height_mm_(profile.segment_height_mm),
      column_mask_(ColumnMask(profile)),
      first_i_(std::int64_t{id.x} * profile.tile_cells),
      first_j_(std::int64_t{id.y} * profile.tile_cells),
      capacity_(input.frames.size()),
      observations_(counts_.size() * capacity_) {
  resamplers_.reserve(capacity_);
  for (std::uint32_t frame = 0; frame < capacity_; ++frame) {
    resamplers_.push_back(MakeResampler(frame));
  }
}

BlockGatherer::Resampler BlockGatherer::MakeResampler(std::uint32_t frame) const {
  const PlacedKeyframe& placed = *input_.frames[frame].placed;
  const KeyframePlacement& p = placed.placement;
  const std::int64_t cos = p.cos_yaw;
  const std::int64_t sin = p.sin_yaw;
  return {placed.keyframe.get(),
          FootprintDisc(p, placed.keyframe->grid),
          2 * cos,
          2 * sin,
          RotatedOrigin(p, cos, sin, cell_size_um_),
          RotatedOrigin(p, -sin, cos, cell_size_um_),
          p.z_um,
          p.slope_x,
          p.slope_y,
          frame};
}

void BlockGatherer::Gather(std::int32_t block_x, std::int32_t block_y) {
  counts_.fill(0);
  const std::int64_t first_i = first_i_ + block_x * kBlockCells;
  const std::int64_t first_j = first_j_ + block_y * kBlockCells;
  const Square block{first_i * cell_size_um_, first_j * cell_size_um_, kBlockCells * cell_size_um_};
  for (const Resampler& resampler : resamplers_) {
    if (Touches(resampler.disc, block)) {
      GatherFrame(resampler, first_i, first_j);
    }
  }
}

void BlockGatherer::GatherFrame(const Resampler& r, std::int64_t first_i, std::int64_t first_j) {
  constexpr int kShift = kFineBits - kCoarseBits;
  // The centre of cell (i, j) is at (2 i + 1, 2 j + 1) half cells.
  const std::int64_t cos = r.cos2 / 2;
  const std::int64_t sin = r.sin2 / 2;
  std::int64_t row_u = cos * (2 * first_i + 1) + sin * (2 * first_j + 1) - r.u_origin;
  std::int64_t row_v = cos * (2 * first_j + 1) - sin * (2 * first_i + 1) - r.v_origin;
  const std::int64_t radius_q16 = std::int64_t{r.keyframe->grid.radius_cells} << kCoarseBits;
  const std::int64_t limit = radius_q16 * radius_q16;
  ColumnLattice lattice(segment_height_mm_);
  std::size_t cell = 0;
  for (std::int32_t y = 0; y < kBlockCells; ++y) {
    std::int64_t u = row_u;
    std::int64_t v = row_v;
    for (std::int32_t x = 0; x < kBlockCells; ++x) {
      const std::int64_t u_q16 = u >> kShift;
      const std::int64_t v_q16 = v >> kShift;
      if (u_q16 * u_q16 + v_q16 * v_q16 < limit) {
        GatherCell(r, u_q16, v_q16, cell, lattice);
      }
      ++cell;
      u += r.cos2;
      v -= r.sin2;
    }
    row_u += r.sin2;
    row_v += r.cos2;
  }
}

// Requires a point inside the disc: then its local cell is inside the grid.
void BlockGatherer::GatherCell(const Resampler& r,
                               std::int64_t u_q16,
                               std::int64_t v_q16,
                               std::size_t cell,
                               ColumnLattice& lattice) {
  const Keyframe& keyframe = *r.keyframe;
  const auto ix = static_cast<std::int32_t>(u_q16 >> kCoarseBits);
  const auto iy = static_cast<std::int32_t>(v_q16 >> kCoarseBits);
  const std::size_t index = keyframe.grid.Index(ix, iy);
  const KeyframeCell& seen = keyframe.cells[index];
  if (seen.source == AltitudeSource::kNone) {
    return;
  }
  const std::int64_t slope_half_cells = r.slope_x * (2 * ix + 1) + r.slope_y * (2 * iy + 1);
  const std::int64_t tilt_um = (slope_half_cells * cell_size_um_) >> kFineBits;
  const std::int64_t d2 = (u_q16 * u_q16 + v_q16 * v_q16) >> (2 * kCoarseBits);
  Observation& out = observations_[cell * capacity_ + counts_[cell]];
  ++counts_[cell];
  out.altitude_mm =
      static_cast<std::int32_t>(RoundDiv(r.z_um + seen.altitude_mm * 1000 + tilt_um, 1000));
  out.frame = r.frame;
  out.column = keyframe.columns[index] & column_mask_;
  out.column_base = 0;
  if (out.column != 0) {
    out.column_base = lattice.NearestIndex(out.altitude_mm - seen.altitude_mm) +
                      keyframe.anchors[keyframe.BlockIndex(ix, iy)];
  }
  out.distance_step = sigmas_.Step(static_cast<std::size_t>(d2));
  out.source = seen.source;
  out.occupancy = seen.occupancy;
}

std::span<const Observation> BlockGatherer::Observations(std::int32_t x, std::int32_t y) const {
  const std::size_t cell = static_cast<std::size_t>(y) * static_cast<std::size_t>(kBlockCells) +
                           static_cast<std::size_t>(x);
  return std::span(observations_).subspan(cell * capacity_, counts_[cell]);
}

}  // namespace atlas
