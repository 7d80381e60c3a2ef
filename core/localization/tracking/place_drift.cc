#include "core/localization/tracking/place_drift.h"

#include <cmath>
#include <numbers>

namespace atlas {

void PlaceDrift::Clear() {
  Return();
  Confirm();
  EndCarry();
}

bool PlaceDrift::HasStrayed() const {
  return strayed_.head<3>().norm() > options_.most_m || std::abs(strayed_(3)) > options_.most_rad;
}

bool PlaceDrift::MovesAlong(const std::optional<Eigen::Vector4d>& off) {
  if (off) {
    moved_off_ += *off;
    if (IsSameStep(moved_off_)) {
      return true;
    }
  }
  moved_off_.setZero();
  return false;
}

bool PlaceDrift::StaysOff(const Eigen::Vector4d& off) {
  const bool stays = !off_carried_ || IsSameStep(off - *off_carried_);
  if (!off_carried_ || !stays) off_carried_ = off;
  return stays;
}

bool PlaceDrift::IsSameStep(const Eigen::Vector4d& difference) const {
  return difference.head<3>().norm() <= options_.same_step_m &&
         std::abs(std::remainder(difference(3), 2.0 * std::numbers::pi)) <= options_.same_step_rad;
}

}  // namespace atlas
