#include "core/scan/rings/ring_splitter.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "core/scan/rings/return_directions.h"
#include "core/scan/rings/ring_cutter.h"
#include "core/scan/rings/ring_origin.h"

namespace atlas {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kLeapSpreads = 2.0F;  // a ring change stands out of the spread within rings

struct SlopeSpread {
  float median = 0.0F;
  float width = 0.0F;  // 5th to 95th percentile
};

// Of long rings from every so-many-th return: 2,000 tell no more than 250.
SlopeSpread MeasureSpread(const std::vector<float>& slope, std::uint32_t begin, std::uint32_t end) {
  constexpr std::uint32_t kEnough = 250;
  const std::uint32_t stride = std::max(1u, (end - begin) / kEnough);
  std::vector<float> values;
  values.reserve((end - begin) / stride + 1);
  for (std::uint32_t i = begin; i < end; i += stride) {
    values.push_back(slope[i]);
  }
  const auto at = [&values](std::size_t percent) {
    return values.begin() + static_cast<std::ptrdiff_t>(values.size() * percent / 100);
  };
  std::nth_element(values.begin(), at(50), values.end());
  const float median = *at(50);
  std::nth_element(values.begin(), at(5), at(50));
  std::nth_element(at(50), at(95), values.end());
  return {median, *at(95) - *at(5)};
}

// Rings of real sensors are not cones (the beams start at different heights, motion is
// compensated): how far the slope wanders within the long rings of this scan tells what a change of
// ring is.
float LeapSlope(const ReturnDirections& directions, const std::vector<std::uint32_t>& cuts) {
  std::uint32_t longest = 0;
  for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
    longest = std::max(longest, cuts[k + 1] - cuts[k]);
  }
  float widest = 0.0F;
  for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
    if (cuts[k + 1] - cuts[k] > longest / 2) {
      widest = std::max(widest, MeasureSpread(directions.slope, cuts[k], cuts[k + 1]).width);
    }
  }
  return std::max(kMinLeapSlope, kLeapSpreads * widest);
}

std::vector<std::uint32_t> FindCuts(const ReturnDirections& directions) {
  constexpr float kNever = 1e9F;
  std::optional<RingCutter> best;
  // Whether rings begin there, without a doubt.
  const auto try_origin = [&](float origin_rad) {
    RingCutter cutter(directions, origin_rad);
    cutter.Cut(kNever);
    if (!best || cutter.score() > best->score()) {
      best.emplace(std::move(cutter));
    }
    return best->IsOrigin();
  };
  // Drivers begin ahead or at the back, as a rule; the first return and the last are where they do,
  // unless those rings have no returns there.
  if (!try_origin(0.0F) && !try_origin(kPi) && !try_origin(directions.azimuth_rad.front()) &&
      !try_origin(directions.azimuth_rad.back())) {
    for (const float origin_rad : SearchOrigins(directions)) {
      try_origin(origin_rad);
    }
  }
  best->Cut(LeapSlope(directions, best->cuts()));
  return best->cuts();
}

// More rings climb than fall.
bool IsBottomFirst(const std::vector<RingRun>& runs) {
  int balance = 0;
  for (std::size_t k = 1; k < runs.size(); ++k) {
    balance += runs[k].elevation_rad > runs[k - 1].elevation_rad ? 1 : -1;
  }
  return balance >= 0;
}

}  // namespace

RingSplit SplitRings(const PointCloud& cloud, const EgoBox& ego) {
  RingSplit split;
  ReturnDirections directions = MeasureDirections(cloud, ego);
  if (directions.index.empty()) {
    return split;
  }
  const std::vector<std::uint32_t> cuts = FindCuts(directions);
  for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
    if (cuts[k + 1] > cuts[k]) {
      const SlopeSpread spread = MeasureSpread(directions.slope, cuts[k], cuts[k + 1]);
      split.runs.push_back({cuts[k], cuts[k + 1], std::atan(spread.median), spread.width});
    }
  }
  split.azimuth_rad = std::move(directions.azimuth_rad);
  split.index = std::move(directions.index);
  split.is_bottom_first = IsBottomFirst(split.runs);
  return split;
}

}  // namespace atlas
