#include "core/localization/window/cell_kernel.h"

#include <cmath>
#include <numbers>

namespace atlas {

CellKernel::CellKernel(float sigma_cells) {
  const double sigma = static_cast<double>(sigma_cells);
  // Of the error: its probability below an edge at a distance, and the derivatives of that.
  const auto below = [&](double edge) {
    return 0.5 * std::erf(edge / (std::numbers::sqrt2 * sigma));
  };
  const auto density = [&](double edge) {
    return std::exp(-0.5 * edge * edge / (sigma * sigma)) /
           (sigma * std::sqrt(2.0 * std::numbers::pi));
  };
  const auto density_slope = [&](double edge) {
    return -edge / (sigma * sigma) * density(edge);
  };
  for (std::size_t step = 0; step <= kSteps; ++step) {
    const double offset = (static_cast<double>(step) + 0.5) / static_cast<double>(kSteps);
    for (std::size_t cells = 0; cells < shares_[step].size(); ++cells) {
      Share& share = shares_[step][cells];
      for (std::size_t cell = 0; cell < 3; ++cell) {
        if (((cells >> cell) & 1U) == 0) {
          continue;
        }
        const double low = static_cast<double>(cell) - 1.0 - offset;
        const double high = low + 1.0;
        share.value += static_cast<float>(below(high) - below(low));
        // As the point moves on, both edges come nearer to it.
        share.slope += static_cast<float>(density(low) - density(high));
        share.curve += static_cast<float>(density_slope(high) - density_slope(low));
      }
    }
  }
}

}  // namespace atlas
