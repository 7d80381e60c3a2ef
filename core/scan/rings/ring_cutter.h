// Cuts the returns of a scan into rings that all begin at one azimuth.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/scan/rings/return_directions.h"

namespace atlas {

class RingCutter {
 public:
  // `directions`, of at least one return, outlives the cutter.
  RingCutter(const ReturnDirections& directions, float origin_rad);

  // Also where a ring leaves a gap and the slope is then another by more than `leap_slope`.
  void Cut(float leap_slope);

  // First returns of the rings, and the number of returns at the end.
  const std::vector<std::uint32_t>& cuts() const { return cuts_; }

  // Rings close: they end at the slope with which they began, a turn before, and not with which the
  // next one begins. How many more do than do not.
  int score() const { return 2 * closed_ - borders_; }
  // Of KITTI's rings 94 to 100 % close where they begin, and 86 % at most anywhere else.
  bool IsOrigin() const { return 100 * closed_ > 93 * borders_; }

 private:
  // From the origin, [0, 2 pi).
  float Turned(std::uint32_t i) const;
  float FromOrigin(std::uint32_t i) const;
  float Rise(std::uint32_t i) const;  // of the slope since the return before
  float MeanSlope(std::uint32_t begin, std::uint32_t end) const;
  void FindJumps();
  bool IsCut(std::uint32_t i, float leap_slope) const;
  bool StaysBehind(std::uint32_t i, float before) const;
  std::uint32_t Refine(std::uint32_t i) const;
  void JudgeBorder(std::uint32_t begin, std::uint32_t cut);

  const ReturnDirections* directions_;
  float origin_rad_;
  std::vector<std::uint32_t> jumps_;  // where a ring may end
  std::vector<std::uint32_t> cuts_;
  int borders_ = 0;  // of rings with returns where they begin and where they end
  int closed_ = 0;   // of those, the ones that close
};

}  // namespace atlas
