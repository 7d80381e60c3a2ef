#include "core/fusion/observation/sigma_table.h"

#include <algorithm>

#include "core/base/integer_math.h"
#include "core/tile/sigma_code.h"

namespace atlas {
namespace {

// floor(kStepsPerCell * sqrt(d2 + 1/2)) for d2 = 0 .. count - 1, by counting up.
std::vector<std::uint16_t> DistanceSteps(std::int64_t count) {
  std::vector<std::uint16_t> steps;
  steps.reserve(static_cast<std::size_t>(count));
  std::int64_t root = 0;
  for (std::int64_t d2 = 0; d2 < count; ++d2) {
    const std::int64_t square =
        (2 * d2 + 1) * SigmaTable::kStepsPerCell * SigmaTable::kStepsPerCell / 2;
    while ((root + 1) * (root + 1) <= square) {
      ++root;
    }
    steps.push_back(static_cast<std::uint16_t>(root));
  }
  return steps;
}

// slope * d of the middle of a step.
std::int64_t SlopeSigma100um(const MapProfile& profile, std::int64_t step) {
  constexpr std::int64_t kUmPpmPerUnit = 100 * 1'000'000;
  return RoundDiv(std::int64_t{profile.sigma_slope_ppm} * profile.cell_size_um * (2 * step + 1),
                  2 * SigmaTable::kStepsPerCell * kUmPpmPerUnit);
}

}  // namespace

SigmaTable::SigmaTable(const MapProfile& profile, std::int32_t max_radius_cells)
    : weight_scale_(kUnitWeight * 100 * profile.sigma_base_mm * profile.sigma_base_mm),
      steps_(DistanceSteps(std::int64_t{max_radius_cells} * max_radius_cells)) {
  const std::array<int, 3> extra_mm{0, profile.sigma_interpolated_mm,
                                    profile.sigma_extrapolated_mm};
  for (std::size_t source = 0; source < entries_.size(); ++source) {
    const std::int64_t base_100um = 10 * (std::int64_t{profile.sigma_base_mm} + extra_mm[source]);
    for (std::int64_t step = 0; step <= steps_.back(); ++step) {
      const std::int64_t sigma = SlopeSigma100um(profile, step) + base_100um;
      const std::int64_t weight = std::max(RoundDiv(weight_scale_, sigma * sigma), std::int64_t{1});
      entries_[source].push_back(
          {static_cast<std::uint32_t>(sigma), static_cast<std::uint32_t>(weight)});
    }
  }
}

std::uint16_t SigmaTable::SigmaOfWeight100um(std::int64_t weight) const {
  const std::uint64_t half_units =
      Isqrt(static_cast<std::uint64_t>(RoundDiv(4 * weight_scale_, weight)));
  return RoundSigma100um((half_units + 1) / 2);
}

}  // namespace atlas
