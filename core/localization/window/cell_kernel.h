// A point's place is known up to an error: how much of it lies in the cells around it. One axis; of
// a plane's cells the shares are products.
#pragma once

#include <array>
#include <cstddef>

namespace atlas {

class CellKernel {
 public:
  // Of the cell before the point's own, of its own and of the next one. They are 1 together but for
  // what is further away, 0.4 % of a point at a cell's edge with the largest error.
  struct Shares {
    std::array<float, 3> value{};
    std::array<float, 3> slope{};  // a cell that the point moves
    std::array<float, 3> curve{};  // the slope's
  };

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
