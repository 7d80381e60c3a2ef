#include "core/fusion/block_gatherer.h"

#include <algorithm>
#include <utility>

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
      blocks_per_side_(profile.tile_cells / kBlockCells) {
  resamplers_.reserve(input.frames.size());
  for (std::uint32_t frame = 0; frame < input.frames.size(); ++frame) {
    resamplers_.push_back(MakeResampler(frame));
  }
}

BlockGatherer::Resampler BlockGatherer::MakeResampler(std::uint32_t frame) const {
  const FrameOnMap& placed = *input_.frames[frame].placed;
  const KeyframePlacement& p = placed.placement;
  const std::int64_t cos = p.cos_yaw;
  const std::int64_t sin = p.sin_yaw;
  return {FootprintDisc(p, placed.grid),
          placed.grid.radius_cells,
          2 * cos,
          2 * sin,
          RotatedOrigin(p, cos, sin, cell_size_um_),
          RotatedOrigin(p, -sin, cos, cell_size_um_),
          p.z_um,
          p.slope_x,
          p.slope_y,
          frame};
}

std::int32_t BlockGatherer::RowsWithin(std::size_t max_bytes) const {
  constexpr std::size_t kBlockBytes =
      static_cast<std::size_t>(kBlockCells * kBlockCells) * sizeof(Observation);
  const std::size_t row_bytes = kBlockBytes * static_cast<std::size_t>(blocks_per_side_) *
                                std::max<std::size_t>(1, resamplers_.size());
  return static_cast<std::int32_t>(std::clamp<std::size_t>(
      max_bytes / row_bytes, 1, static_cast<std::size_t>(blocks_per_side_)));
}

Square BlockGatherer::SquareOf(const Block& block) const {
  return {block.first_i * cell_size_um_, block.first_j * cell_size_um_,
          kBlockCells * cell_size_um_};
}

void BlockGatherer::PrepareBlocks(std::int32_t first_row, std::int32_t rows) {
  first_row_ = first_row;
  blocks_.resize(static_cast<std::size_t>(rows * blocks_per_side_));
  for (std::int32_t y = 0; y < rows; ++y) {
    for (std::int32_t x = 0; x < blocks_per_side_; ++x) {
      Block& block = blocks_[static_cast<std::size_t>(y * blocks_per_side_ + x)];
      block.first_i = first_i_ + x * kBlockCells;
      block.first_j = first_j_ + (first_row + y) * kBlockCells;
      const Square square = SquareOf(block);
      block.capacity = static_cast<std::size_t>(
          std::count_if(resamplers_.begin(), resamplers_.end(),
                        [&](const Resampler& r) { return Touches(r.disc, square); }));
      block.observations.resize(block.counts.size() * block.capacity);
      block.counts.fill(0);
    }
  }
}

Status BlockGatherer::Gather(std::int32_t first_row,
                             std::int32_t rows,
                             const KeyframeSource& source) {
  PrepareBlocks(first_row, rows);
  for (const Resampler& resampler : resamplers_) {
    std::shared_ptr<const Keyframe> keyframe;
    for (Block& block : blocks_) {
      if (!Touches(resampler.disc, SquareOf(block))) {
        continue;
      }
      if (keyframe == nullptr) {
        auto loaded = source(input_.frames[resampler.frame].index);
        if (!loaded) {
          return loaded.error();
        }
        keyframe = std::move(*loaded);
      }
      GatherFrame(resampler, *keyframe, block);
    }
  }
  return {};
}

void BlockGatherer::GatherFrame(const Resampler& r, const Keyframe& keyframe, Block& block) const {
  constexpr int kShift = kFineBits - kCoarseBits;
  // The centre of cell (i, j) is at (2 i + 1, 2 j + 1) half cells.
  const std::int64_t cos = r.cos2 / 2;
  const std::int64_t sin = r.sin2 / 2;
  std::int64_t row_u = cos * (2 * block.first_i + 1) + sin * (2 * block.first_j + 1) - r.u_origin;
  std::int64_t row_v = cos * (2 * block.first_j + 1) - sin * (2 * block.first_i + 1) - r.v_origin;
  const std::int64_t radius_q16 = std::int64_t{r.radius_cells} << kCoarseBits;
  const std::int64_t limit = radius_q16 * radius_q16;
  ColumnLattice lattice(segment_height_mm_);
  std::size_t cell = 0;
  for (std::int32_t y = 0; y < kBlockCells; ++y) {
    std::int64_t u = row_u;
    std::int64_t v = row_v;
    for (std::int32_t x = 0; x < kBlockCells; ++x) {
      const LocalPoint point{u >> kShift, v >> kShift};
      if (point.squared_distance_q32() < limit) {
        GatherCell(r, keyframe, point, cell, lattice, block);
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
                               const Keyframe& keyframe,
                               const LocalPoint& point,
                               std::size_t cell,
                               ColumnLattice& lattice,
                               Block& block) const {
  const auto ix = static_cast<std::int32_t>(point.u_q16 >> kCoarseBits);
  const auto iy = static_cast<std::int32_t>(point.v_q16 >> kCoarseBits);
  const std::size_t index = keyframe.grid.Index(ix, iy);
  const KeyframeCell& seen = keyframe.cells[index];
  if (seen.source == AltitudeSource::kNone) {
    return;
  }
  const std::int64_t slope_half_cells = r.slope_x * (2 * ix + 1) + r.slope_y * (2 * iy + 1);
  const std::int64_t tilt_um = (slope_half_cells * cell_size_um_) >> kFineBits;
  const std::int64_t d2 = point.squared_distance_q32() >> (2 * kCoarseBits);
  Observation& out = block.observations[cell * block.capacity + block.counts[cell]];
  ++block.counts[cell];
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

std::span<const Observation> BlockGatherer::Observations(std::int32_t block_x,
                                                         std::int32_t block_y,
                                                         std::int32_t x,
                                                         std::int32_t y) const {
  const Block& block =
      blocks_[static_cast<std::size_t>((block_y - first_row_) * blocks_per_side_ + block_x)];
  const auto cell = static_cast<std::size_t>(y * kBlockCells + x);
  return std::span(block.observations).subspan(cell * block.capacity, block.counts[cell]);
}

}  // namespace atlas
