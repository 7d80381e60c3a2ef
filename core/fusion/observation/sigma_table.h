// The standard deviation of an altitude by its distance from the sensor (paper III-B:
// sigma = tan 5 deg * d + 0.1 m), and the integer weight 1 / sigma^2 of eq. 3. No floating point.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/geometry/map_profile.h"
#include "core/keyframe/keyframe.h"

namespace atlas {

// A measured cell at the sensor weighs this much; all weights are 1 .. kUnitWeight.
inline constexpr std::int64_t kUnitWeight = std::int64_t{1} << 20;

class SigmaTable {
 public:
  // Distances come in steps of 1/8 cell.
  static constexpr std::int64_t kStepsPerCell = 8;

  SigmaTable(const MapProfile& profile, std::int32_t max_radius_cells);

  // The step of a squared distance in cells, d2 = floor(d^2) < max_radius_cells^2: that of
  // sqrt(d2 + 1/2).
  std::uint16_t Step(std::size_t d2) const { return steps_[d2]; }

  std::uint32_t Sigma100um(AltitudeSource source, std::uint16_t step) const {
    return Of(source)[step].sigma_100um;
  }
  std::uint32_t Weight(AltitudeSource source, std::uint16_t step) const {
    return Of(source)[step].weight;
  }
  // sigma of a sum of weights, rounded for publication.
  std::uint16_t SigmaOfWeight100um(std::int64_t weight) const;

 private:
  struct Entry {
    std::uint32_t sigma_100um = 0;
    std::uint32_t weight = 0;
  };
  const std::vector<Entry>& Of(AltitudeSource source) const {
    return entries_[static_cast<std::size_t>(source) - 1];
  }

  std::int64_t weight_scale_ = 0;  // weight = scale / sigma^2
  std::vector<std::uint16_t> steps_;
  std::array<std::vector<Entry>, 3> entries_;  // measured, interpolated, extrapolated
};

}  // namespace atlas
