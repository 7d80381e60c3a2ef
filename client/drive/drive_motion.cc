#include "client/drive/drive_motion.h"

#include <vector>

#include "client/drive/drive_selection.h"
#include "core/geometry/motion_share.h"
#include "core/localization/scan_clock.h"

namespace atlas {
namespace {

bool AreNumberedOn(const DriveScan& a, const DriveScan& b) {
  return b.number == a.number + 1;
}

std::optional<double> Interval_s(const DriveScan& a, const DriveScan& b) {
  if (!a.time_s || !b.time_s || *b.time_s <= *a.time_s) {
    return std::nullopt;
  }
  return *b.time_s - *a.time_s;
}

}  // namespace

DriveMotion::DriveMotion(const DriveFolder& drive, std::optional<double> revolution_s)
    : drive_(drive), revolution_s_(revolution_s) {
  if (revolution_s_) return;
  std::vector<double> intervals_s;
  for (std::size_t i = 1; i < drive.scans.size(); ++i) {
    const auto interval_s = Interval_s(drive.scans[i - 1], drive.scans[i]);
    if (interval_s && AreNumberedOn(drive.scans[i - 1], drive.scans[i])) {
      intervals_s.push_back(*interval_s);
    }
  }
  if (!intervals_s.empty()) revolution_s_ = UsualInterval_s(intervals_s);
}

std::optional<Pose> DriveMotion::Between(std::size_t from, std::size_t to) const {
  constexpr double kMissing = 1.5;  // else times only jitter
  const DriveScan& a = drive_.scans[from];
  const DriveScan& b = drive_.scans[to];
  const Pose T_a_b = a.T_world_sensor.inverse() * b.T_world_sensor;
  const auto interval_s = Interval_s(a, b);
  // Where numbers are missing times tell for how long.
  const bool is_known = AreNumberedOn(a, b) || (interval_s && revolution_s_);
  if (!is_known || T_a_b.translation().norm() > kSessionJump_m) return std::nullopt;
  const bool is_longer = revolution_s_ && interval_s && *interval_s > kMissing * *revolution_s_;
  return is_longer ? ShareOf(T_a_b, *revolution_s_ / *interval_s) : T_a_b;
}

Pose DriveMotion::During(std::size_t index) const {
  std::optional<Pose> found;
  if (index + 1 < drive_.scans.size()) found = Between(index, index + 1);
  if (!found && index > 0) found = Between(index - 1, index);
  return found.value_or(Pose::Identity());
}

}  // namespace atlas
