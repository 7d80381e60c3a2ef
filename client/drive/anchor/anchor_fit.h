// From scans that were found in a map to how the whole drive lies in it: which of them agree, and
// the transform that fits them best.
#pragma once

#include <cstddef>
#include <numbers>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/pose.h"

namespace atlas {

// A turn about the vertical, then a shift: from one frame whose z points up to another.
struct LevelTransform {
  double yaw_rad = 0.0;
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();

  Pose ToPose() const;
};

// What takes the sensor's place and heading in one frame to those in the other, exactly; how it is
// tilted is the same in both, or left out.
LevelTransform LevelTransformBetween(const Pose& T_to_sensor, const Pose& T_from_sensor);

// A scan where the drive has it, and where it was found in the map.
struct FoundScan {
  Pose T_drive_sensor = Pose::Identity();
  Pose T_map_sensor = Pose::Identity();
};

// Two scans tell of one transform where that of either puts the other where it was found, as well
// as this. A right place is right within 0.5 m, as a rule within 0.05 m and 0.1 degrees.
struct AgreementOptions {
  double distance_m = 0.3;
  double drift = 0.01;  // of the way between the two: what the drive's own poses may be off by
  double yaw_rad = 2.0 * std::numbers::pi / 180.0;
};
bool Agree(const FoundScan& a, const FoundScan& b, const AgreementOptions& options);

// Indices of those that agree with one of them: with the one with which most do. Rising.
std::vector<std::size_t> LargestAgreement(std::span<const FoundScan> found,
                                          const AgreementOptions& options);

// Of where a scan was found, from where a transform puts it.
struct FrameOffset {
  Eigen::Vector3d place_m = Eigen::Vector3d::Zero();
  double yaw_rad = 0.0;
  double turn_rad = 0.0;  // about any axis: what is tilted otherwise, too
};
FrameOffset OffsetFrom(const LevelTransform& T_map_drive, const FoundScan& scan);

// The transform that fits all of `found`, not empty: least squares of places (0.05 m) and headings
// (0.1 degrees), robust against a few that are off.
LevelTransform FitTransform(std::span<const FoundScan> found);

}  // namespace atlas
