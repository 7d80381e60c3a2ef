#include "core/tile/layer_association.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstdlib>

#include "core/tile/overlap_table.h"

namespace atlas {
namespace {

constexpr int kRatioBits = 20;

// The limit x 2^12 at sigma_max / sigma_min x 2^20 (>= 2^20): linear between the table's entries
// and beyond its end, where the true function is linear too.
std::int64_t OverlapLimit(std::uint64_t ratio) {
  const int octave =
      std::min(static_cast<int>(std::bit_width(ratio >> kRatioBits)) - 1, kOverlapOctaves - 1);
  const int step_shift = kRatioBits + octave - kOverlapStepBits;
  const std::uint64_t start = std::uint64_t{1} << (kRatioBits + octave);
  constexpr std::uint64_t kLastStep = (1u << kOverlapStepBits) - 1;
  const std::uint64_t step = std::min((ratio - start) >> step_shift, kLastStep);
  const auto rest = static_cast<std::int64_t>(ratio - start - (step << step_shift));
  const std::size_t index = (static_cast<std::size_t>(octave) << kOverlapStepBits) + step;
  const std::int64_t low = kOverlapLimit[index];
  const std::int64_t slope = kOverlapLimit[index + 1] - low;
  return low + ((slope * rest) >> step_shift);
}

bool ContinuesLayer(const AltitudeEstimate& lowest,
                    const AltitudeEstimate& previous,
                    const AltitudeEstimate& next,
                    const MapProfile& profile) {
  if (profile.preset == FusionPreset::kPaper) {
    return OverlapsAsOneLayer(previous, next);
  }
  const std::int64_t step_mm = std::int64_t{next.altitude_mm} - previous.altitude_mm;
  if (std::int64_t{next.altitude_mm} - lowest.altitude_mm > profile.layer_span_mm) {
    return false;
  }
  if (step_mm <= profile.same_layer_mm) {
    return true;
  }
  return step_mm < profile.other_layer_mm && OverlapsAsOneLayer(previous, next);
}

}  // namespace

bool OverlapsAsOneLayer(const AltitudeEstimate& a, const AltitudeEstimate& b) {
  const auto [sigma_min, sigma_max] = std::minmax(a.sigma_100um, b.sigma_100um);
  assert(sigma_min > 0);
  const std::uint64_t ratio = (std::uint64_t{sigma_max} << kRatioBits) / sigma_min;
  const std::int64_t difference_100um = 10 * std::abs(std::int64_t{a.altitude_mm} - b.altitude_mm);
  return (difference_100um << kOverlapBits) < OverlapLimit(ratio) * sigma_min;
}

std::uint32_t ChainLayers(std::span<const AltitudeEstimate> sorted,
                          const MapProfile& profile,
                          std::span<std::uint32_t> labels) {
  std::uint32_t label = 0;
  std::size_t lowest = 0;
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    if (i > 0 && !ContinuesLayer(sorted[lowest], sorted[i - 1], sorted[i], profile)) {
      ++label;
      lowest = i;
    }
    labels[i] = label;
  }
  return sorted.empty() ? 0 : label + 1;
}

}  // namespace atlas
