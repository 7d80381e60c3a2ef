// A point's place is known up to an error: how much of it lies in some of the cells around it. One
// axis; of a plane's cells the shares are products.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace atlas {

class CellKernel {
 public:
  // Of the cells before the point's own, its own and behind it, a bit each, the lowest first: how
  // much of the point lies in those that are set. All of them are 1 but for what is further away,
  // 0.4 % of a point at a cell's edge with the largest error.
  struct Share {
    float value = 0.0F;
    float slope = 0.0F;  // a cell that the point moves
    float curve = 0.0F;  // the slope's
  };
  using Shares = std::array<Share, 8>;  // by the cells that are set

  // `sigma_cells`: the error's standard deviation, up to 0.4 cells.
  explicit CellKernel(float sigma_cells);

  // `offset`: of the point from its cell's lower edge, [0, 1].
  const Shares& At(float offset) const {
    return shares_[static_cast<std::size_t>(offset * static_cast<float>(kSteps))];
  }

 private:
  static constexpr std::size_t kSteps = 128;

  std::array<Shares, kSteps + 1> shares_;  // rounding may make an offset 1
};

}  // namespace atlas
