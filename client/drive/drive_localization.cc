#include "client/drive/drive_localization.h"

#include <numbers>

#include "client/drive/drive_survey.h"
#include "client/drive/localization_trial.h"
#include "client/drive/tiles_around.h"
#include "client/score/cpu_timer.h"
#include "core/base/str_cat.h"
#include "core/keyframe/keyframe_builder.h"
#include "core/scan/scan_reader.h"

namespace atlas {
namespace {

class DriveLocalization {
 public:
  DriveLocalization(const DriveFolder& drive,
                    const DriveLocalizationOptions& options,
                    DriveSurvey survey,
                    MapView& view,
                    const std::function<void(const LocalizedScan&)>& on_scan)
      : drive_(drive),
        options_(options),
        survey_(std::move(survey)),
        on_scan_(on_scan),
        localizer_(
            view.profile(),
            [&view](const Eigen::Vector3d& center, double radius_m) {
              return TilesAroundPlace(view, center, radius_m);
            },
            LocalizerOptionsFor(options)) {}

  Result<DriveLocalizationReport> Run() {
    std::optional<std::uint32_t> last_part;
    for (const SelectedScan& selected : SelectScans(drive_, options_.selection)) {
      const DriveScan& scan = drive_.scans[selected.index];
      const Result<PointCloud> cloud = ReadScan(scan.scan);
      if (!cloud) return Error(cloud.error());
      const bool is_start = last_part != selected.session_part;
      const Status status = options_.shots ? Shoot(scan, *cloud)
                                           : Track(scan, *cloud, is_start, last_part.has_value());
      if (!status.ok()) return Error(status.WithContext(StrCat("scan ", scan.number)));
      last_part = selected.session_part;
      ++report_.scans;
    }
    return report_;
  }

 private:
  static LocalizerOptions LocalizerOptionsFor(const DriveLocalizationOptions& options) {
    LocalizerOptions result;
    result.features.max_range_m = static_cast<float>(options.max_range_m);
    return result;
  }

  Status Shoot(const DriveScan& scan, const PointCloud& cloud) {
    for (std::uint32_t trial = 0; trial < options_.shots->trials; ++trial) {
      const TrialSeed seed{options_.seed, scan.number, trial};
      const Eigen::Quaterniond R_level_sensor =
          DisturbedLevel(scan.T_world_sensor, options_.tilt_error_rad, seed);
      localizer_.Start(PerturbedStart(scan.T_world_sensor, R_level_sensor,
                                      options_.shots->translation_m, options_.shots->yaw_rad,
                                      seed));
      ATLAS_RETURN_IF_ERROR(Localize(scan, cloud, R_level_sensor, trial));
    }
    return {};
  }

  Status Track(const DriveScan& scan, const PointCloud& cloud, bool is_start, bool is_after_jump) {
    if (is_start) {
      localizer_.Start(scan.T_world_sensor);
      report_.restarts += is_after_jump ? 1U : 0U;
    }
    const Eigen::Quaterniond R_level_sensor = DisturbedLevel(
        scan.T_world_sensor, options_.tilt_error_rad, {options_.seed, scan.number, 0});
    return Localize(scan, cloud, R_level_sensor, 0);
  }

  Status Localize(const DriveScan& scan,
                  const PointCloud& cloud,
                  const Eigen::Quaterniond& R_level_sensor,
                  std::uint32_t trial) {
    const CpuTimer timer;
    const LeveledScan leveled =
        SegmentScan(cloud, survey_.layout, survey_.ring_step, R_level_sensor, {});
    const Result<LocalizationResult> result = localizer_.Localize(leveled, R_level_sensor);
    report_.cpu_s += timer.elapsed_s();
    if (!result) return result.error();
    LocalizedScan localized;
    localized.scan = scan.number;
    localized.trial = trial;
    localized.T_world_sensor = result->T_world_sensor;
    localized.health = result->health;
    localized.error = ErrorOf(result->T_world_sensor, scan.T_world_sensor);
    report_.score.Add(localized.error, result->health == LocalizationHealth::kLost);
    on_scan_(localized);
    return {};
  }

  const DriveFolder& drive_;
  const DriveLocalizationOptions& options_;
  DriveSurvey survey_;
  const std::function<void(const LocalizedScan&)>& on_scan_;
  Localizer localizer_;
  DriveLocalizationReport report_;
};

SurveyOptions SurveyOptionsFor(const DriveLocalizationOptions& options) {
  SurveyOptions survey;
  survey.rings = options.rings;
  return survey;
}

}  // namespace

Status DriveLocalizationOptions::Validate() const {
  ATLAS_RETURN_IF_ERROR(SurveyOptionsFor(*this).Validate());
  if (!(max_range_m >= 1.0 && max_range_m <= 200.0)) {
    return {StatusCode::kInvalidArgument,
            StrCat("maximum range ", max_range_m, " m: expected 1 to 200")};
  }
  if (shots && shots->trials < 1) {
    return {StatusCode::kInvalidArgument, "trials 0: expected at least one"};
  }
  return {};
}

Result<DriveLocalizationReport> LocalizeDrive(
    const DriveFolder& drive,
    const DriveLocalizationOptions& options,
    MapView& view,
    const std::function<void(const LocalizedScan&)>& on_scan) {
  if (Status status = options.Validate(); !status.ok()) return Error(std::move(status));
  Result<DriveSurvey> survey = SurveySensor(drive, SurveyOptionsFor(options));
  if (!survey) return Error(survey.error());
  return DriveLocalization(drive, options, *std::move(survey), view, on_scan).Run();
}

}  // namespace atlas
