// How far estimated poses are from the truth, pooled over all shots.
#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/pose.h"

namespace atlas {

struct PoseError {
  double translation_m = 0.0;  // 3-D distance
  double rotation_deg = 0.0;   // angle of the relative rotation
};
PoseError ErrorOf(const Pose& estimate, const Pose& truth);

// A shot that is lost, or off by more than 1 m or 5 degrees.
bool IsFailure(const PoseError& error, bool is_lost);

class LocalizationScore {
 public:
  // A failure is counted, and left out of the figures below.
  void Add(const PoseError& error, bool is_lost);

  std::uint64_t shots() const { return shots_; }
  std::uint64_t failures() const { return failures_; }
  std::uint64_t successes() const { return translations_m_.size(); }
  std::uint64_t lost() const { return lost_; }
  // 0 without a success.
  double translation_rmse_m() const;
  double rotation_rmse_deg() const;
  // The smallest error that at least 95 % of the shots without failure do not exceed.
  double translation_p95_m() const;

 private:
  std::uint64_t shots_ = 0;
  std::uint64_t failures_ = 0;
  std::uint64_t lost_ = 0;
  std::vector<double> translations_m_;
  double rotation_square_sum_ = 0.0;
};

}  // namespace atlas
