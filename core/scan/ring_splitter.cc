#include "core/scan/ring_splitter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/scan/fast_atan2.h"

namespace atlas {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kTurn = 2.0F * kPi;
constexpr float kStepBack_rad = 0.05F;    // more than the jitter of a motion-compensated ring
constexpr float kLeap_rad = 0.1F;         // a gap in which the ring may have changed
constexpr float kMinLeapSlope = 0.0044F;  // 0.25 deg: less than any two rings are apart
constexpr float kLeapSpreads = 2.0F;      // a ring change stands out of the spread within rings
constexpr float kBorder_rad = 0.02F;      // where a ring's first and last returns may mix
constexpr float kUnknownOrigin = -1.0F;
constexpr std::uint32_t kConfirmations = 3;  // a step back lasts at least this many returns

// Azimuth in the direction of rotation and slope (tangent of the elevation) of the returns from
// the world: what hits the vehicle itself points anywhere.
struct Directions {
  std::vector<float> azimuth_rad;
  std::vector<float> slope;
  std::vector<std::uint32_t> index;  // in the scan
};

Directions MeasureDirections(const PointCloud& cloud, const EgoBox& ego) {
  Directions directions;
  directions.azimuth_rad.reserve(cloud.size());
  directions.slope.reserve(cloud.size());
  directions.index.reserve(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3f& p = cloud.points[i];
    if (!ego.Contains(p)) {
      const float horizontal_m = std::sqrt(p.x() * p.x() + p.y() * p.y());
      directions.azimuth_rad.push_back(FastAtan2(p.y(), p.x()));
      directions.slope.push_back(p.z() / horizontal_m);
      directions.index.push_back(static_cast<std::uint32_t>(i));
    }
  }
  return directions;
}

// Counts azimuths the way the sensor turns, [0, 2 pi).
void FollowRotation(std::vector<float>& azimuth_rad) {
  int turned = 0;
  for (std::size_t i = 1; i < azimuth_rad.size(); ++i) {
    const float step = azimuth_rad[i] - azimuth_rad[i - 1];
    turned += std::abs(step) < kLeap_rad ? (step < 0.0F ? -1 : 1) : 0;
  }
  const float direction = turned < 0 ? -1.0F : 1.0F;
  for (float& angle : azimuth_rad) {
    angle *= direction;
    angle = angle < 0.0F ? angle + kTurn : angle;
  }
}

class Cutter {
 public:
  // `leap_slope`: a change of slope over a gap that is a change of ring.
  Cutter(const Directions& directions, float origin_rad, float leap_slope)
      : azimuth_(directions.azimuth_rad),
        slope_(directions.slope),
        size_(static_cast<std::uint32_t>(directions.slope.size())),
        origin_rad_(origin_rad),
        leap_slope_(leap_slope) {}

  // First returns of the rings, and the number of returns at the end.
  std::vector<std::uint32_t> Cuts() {
    std::vector<std::uint32_t> cuts{0};
    for (std::uint32_t i = 1; i < size_; ++i) {
      if (i > cuts.back() && IsCut(i)) {
        cuts.push_back(std::max(Refine(i), cuts.back() + 1));
      }
    }
    cuts.push_back(size_);
    return cuts;
  }

  // Borders that look like the middle of a ring: few when `origin_rad` is where rings begin.
  int suspicious_borders() const { return suspicious_borders_; }

 private:
  // From the origin, [0, 2 pi).
  float Turned(std::uint32_t i) const {
    const float angle = azimuth_[i] - origin_rad_;
    return angle < 0.0F ? angle + kTurn : angle;
  }

  bool IsCut(std::uint32_t i) {
    const float before = Turned(i - 1);
    const float now = Turned(i);
    if (now < before - kStepBack_rad) {
      const bool is_border = before - now > kTurn - kLeap_rad;
      suspicious_borders_ +=
          static_cast<int>(is_border && std::abs(slope_[i] - slope_[i - 1]) < 1e-3F);
      return StaysBehind(i, before);
    }
    return now > before + kLeap_rad && now < before + kTurn - kLeap_rad &&
           std::abs(MeanSlope(i, i + 5) - MeanSlope(i < 5 ? 0 : i - 5, i)) > leap_slope_;
  }

  bool StaysBehind(std::uint32_t i, float before) const {
    const std::uint32_t end = std::min(i + kConfirmations, size_);
    for (; i < end; ++i) {
      if (Turned(i) > before - 0.5F * kStepBack_rad) {
        return false;
      }
    }
    return true;
  }

  float MeanSlope(std::uint32_t begin, std::uint32_t end) const {
    end = std::min(end, size_);
    float sum = 0.0F;
    for (std::uint32_t i = begin; i < end; ++i) {
      sum += slope_[i];
    }
    return sum / static_cast<float>(end - begin);
  }

  // Around the border the azimuth jitters by a return or two: the cut is where the slope changes.
  std::uint32_t Refine(std::uint32_t i) const {
    std::uint32_t best = i;
    float best_rise = std::abs(slope_[i] - slope_[i - 1]);
    for (std::uint32_t k = i < 4 ? 1 : i - 3; k < std::min(i + 4, size_); ++k) {
      const float from_border = std::min(Turned(k), kTurn - Turned(k));
      const float rise = std::abs(slope_[k] - slope_[k - 1]);
      if (from_border < kBorder_rad && rise > best_rise) {
        best = k;
        best_rise = rise;
      }
    }
    return best;
  }

  const std::vector<float>& azimuth_;
  const std::vector<float>& slope_;
  std::uint32_t size_;
  float origin_rad_;
  float leap_slope_;
  int suspicious_borders_ = 0;
};

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
    const std::size_t index = std::min(values.size() - 1, values.size() * percent / 100);
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(index),
                     values.end());
    return values[index];
  };
  return {at(50), at(95) - at(5)};
}

// Rings of real sensors are not cones (the beams start at different heights, motion is
// compensated): how far the slope wanders within the long rings of this scan tells what a change of
// ring is.
float LeapSlope(const Directions& directions, const std::vector<std::uint32_t>& cuts) {
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

// Where rings begin, if they do so at one azimuth: everywhere else they pass smoothly, there the
// slope leaps.
float SearchOrigin(const Directions& directions) {
  constexpr int kBins = 4096;  // narrower than the gap between two returns
  constexpr float kBinsPerRad = static_cast<float>(kBins) / kTurn;
  std::array<int, kBins> leaps_over_passes{};  // at the bins' lower edges
  for (std::size_t i = 1; i < directions.slope.size(); ++i) {
    float ahead = directions.azimuth_rad[i] - directions.azimuth_rad[i - 1];
    ahead += ahead < -kPi ? kTurn : 0.0F;
    if (ahead <= 0.0F || ahead >= kLeap_rad) {
      continue;
    }
    const int first = static_cast<int>(directions.azimuth_rad[i - 1] * kBinsPerRad) + 1;
    const int last = static_cast<int>((directions.azimuth_rad[i - 1] + ahead) * kBinsPerRad);
    const bool is_leap = std::abs(directions.slope[i] - directions.slope[i - 1]) > kMinLeapSlope;
    for (int bin = first; bin <= last; ++bin) {
      leaps_over_passes[static_cast<std::size_t>(bin % kBins)] += is_leap ? 1 : -1;
    }
  }
  const auto best = std::max_element(leaps_over_passes.begin(), leaps_over_passes.end());
  return static_cast<float>(best - leaps_over_passes.begin()) / kBinsPerRad;
}

std::vector<std::uint32_t> FindCuts(const Directions& directions) {
  constexpr float kNever = 1e9F;
  float origin_rad = 0.0F;
  std::vector<std::uint32_t> cuts;
  // Drivers begin ahead or at the back, as a rule.
  for (const float guess_rad : {0.0F, kPi, kUnknownOrigin}) {
    origin_rad = guess_rad == kUnknownOrigin ? SearchOrigin(directions) : guess_rad;
    Cutter coarse(directions, origin_rad, kNever);
    cuts = coarse.Cuts();
    if (2 * coarse.suspicious_borders() <= static_cast<int>(cuts.size())) {
      break;
    }
  }
  return Cutter(directions, origin_rad, LeapSlope(directions, cuts)).Cuts();
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
  Directions directions = MeasureDirections(cloud, ego);
  if (directions.index.empty()) {
    return split;
  }
  FollowRotation(directions.azimuth_rad);
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
