// A drive's scans as they are matched: read, segmented, upright, and deskewed where its keyframes
// are.
#pragma once

#include <functional>
#include <optional>
#include <utility>

#include <Eigen/Geometry>

#include "client/drive/drive_survey.h"
#include "core/base/status.h"
#include "core/geometry/pose.h"
#include "core/scan/drive_folder.h"
#include "core/scan/leveled_scan.h"

namespace atlas {

// T_now_later during a scan of the drive, as of DriveMotion; none: it is not deskewed.
using MotionDuringScan = std::function<std::optional<Pose>(const DriveScan&)>;

class ScanSource {
 public:
  // An empty `motion`: no scan is deskewed.
  ScanSource(const DriveSurvey& survey, MotionDuringScan motion)
      : survey_(survey), motion_(std::move(motion)) {}

  // Fails as ReadScan.
  Result<LeveledScan> Read(const DriveScan& scan) const;

 private:
  DriveSurvey survey_;
  MotionDuringScan motion_;
};

// What turns a scan upright, as the drive's own pose says.
Eigen::Quaterniond LevelOf(const DriveScan& scan);

}  // namespace atlas
