#include "client/drive/drive_relocalization.h"

#include <algorithm>
#include <utility>

#include "client/drive/drive_survey.h"
#include "client/drive/localization_trial.h"
#include "client/drive/place_reader.h"
#include "client/drive/tiles_around.h"
#include "client/score/cpu_timer.h"
#include "core/base/str_cat.h"
#include "core/keyframe/keyframe_builder.h"
#include "core/scan/scan_reader.h"

namespace atlas {
namespace {

SurveyOptions SurveyOptionsFor(const DriveRelocalizationOptions& options) {
  SurveyOptions survey;
  survey.rings = options.rings;
  return survey;
}

RelocalizerOptions RelocalizerOptionsFor(const DriveRelocalizationOptions& options) {
  RelocalizerOptions result;
  result.features.max_range_m = static_cast<float>(options.max_range_m);
  return result;
}

RelocalizedScan Judged(const DriveScan& scan,
                       Relocalization found,
                       const Eigen::Quaterniond& R_level_sensor) {
  RelocalizedScan result{scan.number, scan.time_s, std::move(found), {}, {}};
  if (!result.found.places.empty()) {
    Pose pose = result.found.places.front().registration.T_world_level;
    pose.linear() *= R_level_sensor.toRotationMatrix();
    result.error = ErrorOf(pose, scan.T_world_sensor);
    result.offset = OffsetOf(pose, scan.T_world_sensor);
  }
  return result;
}

PlacePrior ReachOf(const DriveRelocalizationOptions& options) {
  PlacePrior prior;
  if (options.prior_radius_m) prior.radius_m = *options.prior_radius_m;
  if (options.prior_height_m) prior.height_m = *options.prior_height_m;
  return prior;
}

PlacePrior PriorOf(const DriveScan& scan,
                   const DriveRelocalizationOptions& options,
                   const TrialSeed& seed) {
  PlacePrior prior = ReachOf(options);
  const Eigen::Vector3d position =
      PerturbedPosition(scan.T_world_sensor, options.prior_radius_m.value_or(0.0),
                        options.prior_height_m.value_or(0.0), seed);
  prior.center = position.head<2>();
  prior.z_m = position.z();
  return prior;
}

}  // namespace

Status DriveRelocalizationOptions::Validate() const {
  ATLAS_RETURN_IF_ERROR(SurveyOptionsFor(*this).Validate());
  if (!(max_range_m >= 1.0 && max_range_m <= 200.0)) {
    return {StatusCode::kInvalidArgument,
            StrCat("maximum range ", max_range_m, " m: expected 1 to 200")};
  }
  return ReachOf(*this).Validate();
}

Result<DriveRelocalizationReport> RelocalizeDrive(
    const DriveFolder& drive,
    const DriveRelocalizationOptions& options,
    MapView& view,
    const std::function<void(const RelocalizedScan&)>& on_scan) {
  if (Status status = options.Validate(); !status.ok()) return Error(std::move(status));
  const Result<DriveSurvey> survey = SurveySensor(drive, SurveyOptionsFor(options));
  if (!survey) return Error(survey.error());
  auto places = ReadPlaces(view);
  if (!places) return Error(places.error());
  DriveRelocalizationReport report;
  report.places = (*places)->places();
  const Relocalizer relocalizer(view.profile(), *std::move(places), TilesOf(view),
                                RelocalizerOptionsFor(options));
  for (const SelectedScan& selected : SelectScans(drive, options.selection)) {
    const DriveScan& scan = drive.scans[selected.index];
    const Result<PointCloud> cloud = ReadScan(scan.scan);
    if (!cloud) {
      if (cloud.error().code() != StatusCode::kInvalidData) return Error(cloud.error());
      report.unreadable.push_back({scan.number, cloud.error()});
      ++report.scans;
      ++report.unknown;
      on_scan({scan.number, scan.time_s, {}, {}, {}});
      continue;
    }
    report.dropped_returns += cloud->dropped.size();
    const TrialSeed seed{options.seed, scan.number, 0};
    const Eigen::Quaterniond R_level_sensor =
        DisturbedLevel(scan.T_world_sensor, options.tilt_error_rad, seed);
    const PlacePrior prior = PriorOf(scan, options, seed);
    const CpuTimer timer;
    const LeveledScan leveled =
        SegmentScan(*cloud, survey->layout, survey->ring_step, R_level_sensor, {});
    auto found = relocalizer.Find(leveled, R_level_sensor, prior);
    const double cpu_s = timer.elapsed_s();
    if (!found) return Error(found.error().WithContext(StrCat("scan ", scan.number)));
    const RelocalizedScan result = Judged(scan, *std::move(found), R_level_sensor);
    report.cpu_s += cpu_s;
    report.worst_cpu_s = std::max(report.worst_cpu_s, cpu_s);
    ++report.scans;
    if (!result.found.T_world_sensor) {
      ++report.unknown;
    } else if (result.error.translation_m <= DriveRelocalizationReport::kRight_m) {
      ++report.right;
      report.score.Add(result.error, false);
    } else {
      ++report.wrong;
    }
    on_scan(result);
  }
  return report;
}

}  // namespace atlas
