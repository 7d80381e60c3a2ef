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

  // Memory: kBlockCells^2 observations (6 KiB) for each frame of `input`, which, like `sigmas`,
  // must outlive the gatherer.
  BlockGatherer(const TileId& id,
                const FusionInput& input,
                const SigmaTable& sigmas,
                const MapProfile& profile);

  // Collects block (block_x, block_y) of the tile, replacing the block before.
  void Gather(std::int32_t block_x, std::int32_t block_y);

  // Of cell (x, y) of the block, in canonical order.
  std::span<const Observation> Observations(std::int32_t x, std::int32_t y) const;

 private:
  // A frame as the resampler needs it. u and v are levelled coordinates in half cells x 2^30, that
  // is in cells x 2^31.
  struct Resampler {
    const Keyframe* keyframe = nullptr;
    Disc disc;
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

  Resampler MakeResampler(std::uint32_t frame) const;
  void GatherFrame(const Resampler& resampler, std::int64_t first_i, std::int64_t first_j);
  void GatherCell(const Resampler& resampler,
                  std::int64_t u_q16,
                  std::int64_t v_q16,
                  std::size_t cell,
                  ColumnLattice& lattice);

  const FusionInput& input_;
  const SigmaTable& sigmas_;
  std::int64_t cell_size_um_;
  std::int32_t segment_height_mm_;
  std::uint64_t column_mask_;
  std::int64_t first_i_;  // world cell indices of the tile's corner
  std::int64_t first_j_;
  std::vector<Resampler> resamplers_;
  std::size_t capacity_ = 0;  // observations a cell can have
  std::vector<Observation> observations_;
  std::array<std::uint32_t, static_cast<std::size_t>(kBlockCells* kBlockCells)> counts_{};
};

}  // namespace atlas
