#include "core/scan/rings/ring_cutter.h"

#include <cmath>
#include <numbers>

namespace atlas {
namespace {

constexpr float kTurn = 2.0F * std::numbers::pi_v<float>;
constexpr float kStepBack_rad = 0.05F;       // more than the jitter of a motion-compensated ring
constexpr float kBorder_rad = 0.02F;         // where a ring's first and last returns may mix
constexpr std::uint32_t kConfirmations = 3;  // a step back lasts at least this many returns

}  // namespace

RingCutter::RingCutter(const ReturnDirections& directions, float origin_rad)
    : directions_(&directions), origin_rad_(origin_rad) {
  FindJumps();
}

void RingCutter::Cut(float leap_slope) {
  borders_ = 0;
  closed_ = 0;
  cuts_.assign(1, 0);
  for (const std::uint32_t i : jumps_) {
    if (i > cuts_.back() && IsCut(i, leap_slope)) {
      const std::uint32_t cut = std::max(Refine(i), cuts_.back() + 1);
      if (Turned(i - 1) - Turned(i) > kTurn - kNeighbours_rad) {
        JudgeBorder(cuts_.back(), cut);
      }
      cuts_.push_back(cut);
    }
  }
  cuts_.push_back(directions_->size());
}

float RingCutter::Turned(std::uint32_t i) const {
  const float angle = directions_->azimuth_rad[i] - origin_rad_;
  return angle < 0.0F ? angle + kTurn : angle;
}

float RingCutter::FromOrigin(std::uint32_t i) const {
  return std::min(Turned(i), kTurn - Turned(i));
}

float RingCutter::Rise(std::uint32_t i) const {
  return std::abs(directions_->slope[i] - directions_->slope[i - 1]);
}

float RingCutter::MeanSlope(std::uint32_t begin, std::uint32_t end) const {
  end = std::min(end, directions_->size());
  float sum = 0.0F;
  for (std::uint32_t i = begin; i < end; ++i) {
    sum += directions_->slope[i];
  }
  return sum / static_cast<float>(end - begin);
}

// Where the azimuth steps back or leaps ahead: nowhere else a ring can end.
void RingCutter::FindJumps() {
  const std::uint32_t size = directions_->size();
  jumps_.resize(size);
  std::size_t count = 0;
  float before = Turned(0);
  for (std::uint32_t i = 1; i < size; ++i) {
    const float now = Turned(i);
    jumps_[count] = i;
    count += static_cast<std::size_t>(now < before - kStepBack_rad) |
             static_cast<std::size_t>(now > before + kNeighbours_rad);
    before = now;
  }
  jumps_.resize(count);
}

bool RingCutter::IsCut(std::uint32_t i, float leap_slope) const {
  const float before = Turned(i - 1);
  const float now = Turned(i);
  if (now < before - kStepBack_rad) {
    return StaysBehind(i, before);
  }
  return now > before + kNeighbours_rad && now < before + kTurn - kNeighbours_rad &&
         std::abs(MeanSlope(i, i + 5) - MeanSlope(i < 5 ? 0 : i - 5, i)) > leap_slope;
}

bool RingCutter::StaysBehind(std::uint32_t i, float before) const {
  const std::uint32_t end = std::min(i + kConfirmations, directions_->size());
  for (; i < end; ++i) {
    if (Turned(i) > before - 0.5F * kStepBack_rad) {
      return false;
    }
  }
  return true;
}

// Around the border the azimuth jitters by a return or two: the cut is where the slope changes.
std::uint32_t RingCutter::Refine(std::uint32_t i) const {
  std::uint32_t best = i;
  float best_rise = Rise(i);
  for (std::uint32_t k = i < 4 ? 1 : i - 3; k < std::min(i + 4, directions_->size()); ++k) {
    const float rise = Rise(k);
    if (FromOrigin(k) < kBorder_rad && rise > best_rise) {
      best = k;
      best_rise = rise;
    }
  }
  return best;
}

void RingCutter::JudgeBorder(std::uint32_t begin, std::uint32_t cut) {
  constexpr std::uint32_t kMean = 3;  // returns
  if (cut < begin + 2 * kMean || FromOrigin(begin) > kNeighbours_rad) {
    return;
  }
  const float end_slope = MeanSlope(cut - kMean, cut);
  const float to_itself = std::abs(end_slope - MeanSlope(begin, begin + kMean));
  const float to_next = std::abs(end_slope - MeanSlope(cut, cut + kMean));
  ++borders_;
  closed_ += to_itself < 0.5F * to_next ? 1 : 0;
}

}  // namespace atlas
