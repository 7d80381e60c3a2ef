// Collects the observations of a block of cells from all keyframes: inverse nearest resampling, so
// that a keyframe says at most one thing about a cell, whichever tile asks.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/fusion/disc.h"
#include "core/fusion/fusion_input.h"
#include "core/fusion/observation.h"
#include "core/fusion/sigma_table.h"

namespace atlas {

class BlockGatherer {
 public:
  // Small enough that a block of a keyframe stays in the cache while its rows are walked.
  static constexpr std::int32_t kBlockCells = 16;

  // `input` and `sigmas` must outlive the gatherer.
  BlockGatherer(const TileId& id,
                const FusionInput& input,
                const SigmaTable& sigmas,
                const MapProfile& profile);

  // How many rows of blocks can be gathered at once within `max_bytes`, one at least: a block takes
  // kBlockCells^2 observations (6 KiB) for each frame that reaches it.
  std::int32_t RowsWithin(std::size_t max_bytes) const;

  // Collects `rows` rows of the tile's blocks from `first_row` on, replacing those before. Each
  // keyframe that reaches them is asked of `source` once. Errors are the source's.
  Status Gather(std::int32_t first_row, std::int32_t rows, const KeyframeSource& source);

  // Of cell (x, y) of a gathered block, in canonical order.
  std::span<const Observation> Observations(std::int32_t block_x,
                                            std::int32_t block_y,
                                            std::int32_t x,
                                            std::int32_t y) const;

 private:
  // A frame as the resampler needs it. u and v are levelled coordinates in half cells x 2^30, that
  // is in cells x 2^31.
  struct Resampler {
    Disc disc;
    std::int32_t radius_cells = 0;
    std::int64_t cos2 = 0;  // of one cell's step
    std::int64_t sin2 = 0;
    std::int64_t u_origin = 0;
    std::int64_t v_origin = 0;
    std::int64_t z_um = 0;
    std::int64_t slope_x = 0;
    std::int64_t slope_y = 0;
    std::uint32_t frame = 0;
  };
  class ColumnLattice;
  // A point of the map in a keyframe's levelled frame, cells x 2^16.
  struct LocalPoint {
    std::int64_t u_q16 = 0;
    std::int64_t v_q16 = 0;

    std::int64_t squared_distance_q32() const { return u_q16 * u_q16 + v_q16 * v_q16; }
  };

  // The observations of one block; each cell has room for one of every frame that reaches it.
  struct Block {
    std::int64_t first_i = 0;  // world cell indices of its corner
    std::int64_t first_j = 0;
    std::size_t capacity = 0;
    std::vector<Observation> observations;
    std::array<std::uint32_t, static_cast<std::size_t>(kBlockCells* kBlockCells)> counts{};
  };

  void PrepareBlocks(std::int32_t first_row, std::int32_t rows);
  Square SquareOf(const Block& block) const;
  Resampler MakeResampler(std::uint32_t frame) const;
  void GatherFrame(const Resampler& resampler, const Keyframe& keyframe, Block& block) const;
  void GatherCell(const Resampler& resampler,
                  const Keyframe& keyframe,
                  const LocalPoint& point,
                  std::size_t cell,
                  ColumnLattice& lattice,
                  Block& block) const;

  const FusionInput& input_;
  const SigmaTable& sigmas_;
  std::int64_t cell_size_um_;
  std::int32_t segment_height_mm_;
  std::uint64_t column_mask_;
  std::int64_t first_i_;  // world cell indices of the tile's corner
  std::int64_t first_j_;
  std::int32_t blocks_per_side_;
  std::vector<Resampler> resamplers_;
  std::int32_t first_row_ = 0;
  std::vector<Block> blocks_;  // of the gathered rows
};

}  // namespace atlas
