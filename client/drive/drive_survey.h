// What has to be known about a recorded drive's sensor before keyframes can be made of its scans.
// A function of the folder alone, not of which scans are used: ingesting a drive in pieces makes
// the same keyframes.
#pragma once

#include <optional>

#include "core/base/status.h"
#include "core/keyframe/sensor_mount.h"
#include "core/scan/drive_folder.h"
#include "core/scan/sensor_layout.h"
#include "core/traversability/segmenter.h"

namespace atlas {

struct SurveyOptions {
  std::optional<std::uint32_t> rings;     // keep about so many channels; all, if not given
  std::optional<double> sensor_height_m;  // estimated with the rest of the mount, if not given
  SegmenterOptions segmenter;
  std::size_t max_layout_scans = 200;  // read for the layout, evenly spread over the drive
  std::size_t max_mount_scans = 48;    // segmented for the mount, likewise

  // kInvalidArgument for rings outside of 1 to 64.
  Status Validate() const;
};

struct DriveSurvey {
  SensorLayout layout;
  int ring_step = 1;
  SensorMount mount;
};

// Scans that cannot be read are passed over here, unless there is no other: they fail where they
// are used. kInvalidData when no rings are found, or no ground and no height is given: the sensor
// is then taken to be upright.
Result<DriveSurvey> SurveyDrive(const DriveFolder& drive, const SurveyOptions& options);

// The part of the survey that needs no segmentation: layout and ring step, not the mount.
Result<DriveSurvey> SurveySensor(const DriveFolder& drive, const SurveyOptions& options);

}  // namespace atlas
