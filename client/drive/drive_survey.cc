#include "client/drive/drive_survey.h"

#include <algorithm>
#include <functional>

#include "core/base/str_cat.h"
#include "core/keyframe/keyframe_builder.h"
#include "core/scan/scan_reader.h"

namespace atlas {
namespace {

// Up to `count` scans evenly spread over the drive, its first among them. The first failure, when
// no scan could be read.
Status ForSomeScans(const DriveFolder& drive,
                    std::size_t count,
                    const std::function<void(const DriveScan&, const PointCloud&)>& use) {
  Status first_failure;
  bool is_any_read = false;
  const std::size_t total = drive.scans.size();
  const std::size_t wanted = std::min(count, total);
  for (std::size_t i = 0; i < wanted; ++i) {
    const DriveScan& scan = drive.scans[i * total / wanted];
    const Result<PointCloud> cloud = ReadScan(scan.scan);
    if (cloud) {
      is_any_read = true;
      use(scan, *cloud);
    } else if (first_failure.ok()) {
      first_failure = cloud.error();
    }
  }
  return is_any_read ? Status() : first_failure;
}

Result<SensorMount> SurveyMount(const DriveFolder& drive,
                                const DriveSurvey& survey,
                                const SurveyOptions& options) {
  SensorMountEstimator estimator;
  const Status status = ForSomeScans(
      drive, options.max_mount_scans, [&](const DriveScan& scan, const PointCloud& cloud) {
        const Eigen::Quaterniond R_level_sensor =
            SplitYaw(Eigen::Quaterniond(scan.T_world_sensor.linear())).R_level_sensor;
        estimator.Add(
            SegmentScan(cloud, survey.layout, survey.ring_step, R_level_sensor, options.segmenter),
            R_level_sensor);
      });
  if (!status.ok()) return Error(status);
  return estimator.Estimate();
}

}  // namespace

Status SurveyOptions::Validate() const {
  return rings && (*rings < 1 || *rings > 64)
             ? Status(StatusCode::kInvalidArgument, StrCat("rings ", *rings, ": expected 1 to 64"))
             : Status();
}

Result<DriveSurvey> SurveySensor(const DriveFolder& drive, const SurveyOptions& options) {
  if (Status status = options.Validate(); !status.ok()) return Error(std::move(status));
  SensorLayoutEstimator estimator;
  const Status status =
      ForSomeScans(drive, options.max_layout_scans,
                   [&](const DriveScan&, const PointCloud& cloud) { estimator.Add(cloud); });
  if (!status.ok()) return Error(status);
  Result<SensorLayout> layout = estimator.Estimate();
  if (!layout) return Error(layout.error().WithContext(drive.path.string()));
  DriveSurvey survey;
  survey.layout = *std::move(layout);
  if (options.rings) {
    survey.ring_step = RingStep(survey.layout.channels(), static_cast<int>(*options.rings));
  }
  return survey;
}

Result<DriveSurvey> SurveyDrive(const DriveFolder& drive, const SurveyOptions& options) {
  Result<DriveSurvey> survey = SurveySensor(drive, options);
  if (!survey) return survey;
  const Result<SensorMount> mount = SurveyMount(drive, *survey, options);
  if (mount) {
    survey->mount = *mount;
  } else if (!options.sensor_height_m) {
    return Error(mount.error().WithContext(drive.path.string()));
  }
  survey->mount.height_m = options.sensor_height_m.value_or(survey->mount.height_m);
  return survey;
}

}  // namespace atlas
