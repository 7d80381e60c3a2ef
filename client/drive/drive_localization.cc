#include "client/drive/drive_localization.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "client/drive/drive_survey.h"
#include "client/drive/drive_times.h"
#include "client/drive/localization_trial.h"
#include "client/score/cpu_timer.h"
#include "core/base/str_cat.h"
#include "core/localization/scan_clock.h"
#include "core/scan/scan_reader.h"

namespace atlas {
namespace {

class DriveLocalization {
 public:
  DriveLocalization(const DriveFolder& drive,
                    const DriveLocalizationOptions& options,
                    ScanLocalizer& localizer,
                    const std::function<void(const LocalizedScan&)>& on_scan)
      : drive_(drive), options_(options), on_scan_(on_scan), localizer_(localizer) {}

  Result<DriveLocalizationReport> Run() {
    std::optional<std::uint32_t> last_part;
    const std::vector<SelectedScan> scans = SelectScans(drive_, options_.selection);
    const std::vector<std::optional<double>> times = TimesOf(drive_, scans);
    clock_ = ScanClock(UsualIntervalOf(times));
    for (std::size_t i = 0; i < scans.size(); ++i) {
      const SelectedScan& selected = scans[i];
      time_ = times[i];
      const DriveScan& scan = drive_.scans[selected.index];
      const Result<PointCloud> cloud = ReadScan(scan.scan);
      if (!cloud && !(IsDamaged(cloud.error()) && !options_.shots)) return Error(cloud.error());
      ++report_.scans;
      if (!cloud) {
        NoteUnreadable(scan, cloud.error());
        continue;
      }
      report_.dropped_returns += cloud->dropped.size();
      const bool is_start = last_part != selected.session_part;
      const Status status = options_.shots ? Shoot(scan, *cloud)
                                           : Track(scan, *cloud, is_start, last_part.has_value());
      if (!status.ok()) return Error(status.WithContext(StrCat("scan ", scan.number)));
      last_part = selected.session_part;
    }
    return report_;
  }

 private:
  Status Shoot(const DriveScan& scan, const PointCloud& cloud) {
    for (std::uint32_t trial = 0; trial < options_.shots->trials; ++trial) {
      const TrialSeed seed{options_.seed, scan.number, trial};
      const Eigen::Quaterniond R_level_sensor =
          DisturbedLevel(scan.T_world_sensor, options_.tilt_error_rad, seed);
      localizer_.Start(PerturbedStart(scan.T_world_sensor, R_level_sensor,
                                      options_.shots->translation_m, options_.shots->yaw_rad, seed),
                       StartHint{options_.shots->translation_m, options_.shots->yaw_rad});
      LocalizedScan localized;
      localized.trial = trial;
      ATLAS_RETURN_IF_ERROR(Localize(scan, cloud, R_level_sensor, localized));
    }
    return {};
  }

  Status Track(const DriveScan& scan, const PointCloud& cloud, bool is_start, bool is_after_jump) {
    if (is_start && (options_.is_restarted || !is_after_jump)) {
      Start(scan);
      clock_.Restart();
      report_.restarts += is_after_jump ? 1U : 0U;
    }
    const Eigen::Quaterniond R_level_sensor = DisturbedLevel(
        scan.T_world_sensor, options_.tilt_error_rad, {options_.seed, scan.number, 0});
    LocalizedScan localized;
    localized.is_after_jump = is_start && is_after_jump && options_.is_restarted;
    return Localize(scan, cloud, R_level_sensor, localized);
  }

  void Start(const DriveScan& scan) {
    if (!options_.start) {
      localizer_.Start(scan.T_world_sensor, StartHint());
      return;
    }
    const double radius_m = options_.start->radius_m;
    const double height_m = options_.start->height_m;
    Pose start = scan.T_world_sensor;
    start.translation() =
        PerturbedPosition(scan.T_world_sensor, radius_m, height_m, {options_.seed, scan.number, 0});
    const EdgeOptions believed;
    const double sigma_m = radius_m / believed.reachable_sigmas;
    const Eigen::Vector4d sigmas(sigma_m, sigma_m, height_m / believed.reachable_up_sigmas,
                                 MotionOptions().start_rad);
    localizer_.Start(start, PoseCovariance(sigmas.cwiseAbs2().asDiagonal()));
  }

  Status Localize(const DriveScan& scan,
                  const PointCloud& cloud,
                  const Eigen::Quaterniond& R_level_sensor,
                  LocalizedScan localized) {
    if (options_.monitor != nullptr) options_.monitor->Begin(scan.number);
    const CpuTimer timer;
    Result<LocatedScan> located = localizer_.Locate(cloud, R_level_sensor, clock_.Tick(time_));
    localized.cpu_s = timer.elapsed_s();
    if (!located) return located.error();
    localized.scan = scan.number;
    localized.time_s = scan.time_s;
    localized.located = *std::move(located);
    last_ = localized.located.T_world_sensor;
    Judge(scan.T_world_sensor, localized);
    on_scan_(localized);
    return {};
  }

  static bool IsDamaged(const Status& status) { return status.code() == StatusCode::kInvalidData; }

  // Lost, where the scan before it was; the world's origin where none was.
  void NoteUnreadable(const DriveScan& scan, const Status& why) {
    report_.unreadable.push_back({scan.number, why});
    LocalizedScan localized;
    localized.scan = scan.number;
    localized.time_s = scan.time_s;
    localized.located.T_world_sensor = last_.value_or(Pose::Identity());
    localized.located.health = LocalizationHealth::kLost;
    Judge(scan.T_world_sensor, localized);
    on_scan_(localized);
  }

  void Judge(const Pose& truth, LocalizedScan& localized) {
    const LocatedScan& located = localized.located;
    const bool is_lost = located.health == LocalizationHealth::kLost;
    const bool is_good = located.health == LocalizationHealth::kGood;
    localized.error = ErrorOf(located.T_world_sensor, truth);
    localized.offset = OffsetOf(located.T_world_sensor, truth);
    localized.is_failure = IsFailure(localized.error, is_lost);
    if (located.covariance) {
      localized.covariance = AlongHeading(*located.covariance, truth);
      localized.normalized_square = NormalizedSquare(localized.offset, *localized.covariance);
    }
    report_.good += is_good ? 1U : 0U;
    report_.weak += !is_good && !is_lost ? 1U : 0U;
    report_.good_failures += is_good && localized.is_failure ? 1U : 0U;
    report_.score.Add(localized.error, is_lost);
    report_.cpu_s += localized.cpu_s;
  }

  const DriveFolder& drive_;
  const DriveLocalizationOptions& options_;
  const std::function<void(const LocalizedScan&)>& on_scan_;
  ScanLocalizer& localizer_;
  ScanClock clock_;
  std::optional<double> time_;  // of the scan at hand, TimesOf()
  std::optional<Pose> last_;
  DriveLocalizationReport report_;
};

OnLocalization ListenerOf(DriveMonitor* monitor) {
  if (monitor == nullptr) return {};
  return [monitor](const LeveledScan& leveled, const Eigen::Quaterniond& R_level_sensor,
                   const LocalizationResult& result) {
    return monitor->Observe(leveled, R_level_sensor, result);
  };
}

SurveyOptions SurveyOptionsFor(const DriveLocalizationOptions& options) {
  SurveyOptions survey;
  survey.rings = options.rings;
  return survey;
}

// From one scan that is used to the next.
double RevolutionsBetween(const DriveFolder& drive, const DriveLocalizationOptions& options) {
  const auto& revolution_s = options.deskew.revolution_s;
  if (!revolution_s) return options.selection.parity == ScanParity::kAll ? 1.0 : 2.0;
  const std::vector<SelectedScan> selected = SelectScans(drive, options.selection);
  if (!IsTimed(drive, selected)) return 1.0;
  const auto interval_s = UsualIntervalOf(TimesOf(drive, selected));
  return std::max(1.0, interval_s.value_or(*revolution_s) / *revolution_s);
}

Result<std::unique_ptr<ScanLocalizer>> MakeLocalizer(const DriveFolder& drive,
                                                     const DriveSurvey& survey,
                                                     const DriveLocalizationOptions& options,
                                                     bool is_deskewed,
                                                     MapView& view) {
  if (options.mode == LocalizationMode::kPaper) {
    return MakePaperLocalizer(survey, options.range_m(), view);
  }
  const double revolutions = RevolutionsBetween(drive, options);
  return MakeAtlasLocalizer(survey, options.range_m(), view,
                            is_deskewed ? std::optional(revolutions) : std::nullopt,
                            ListenerOf(options.monitor));
}

}  // namespace

Status DriveLocalizationOptions::Validate() const {
  ATLAS_RETURN_IF_ERROR(SurveyOptionsFor(*this).Validate());
  if (!(range_m() >= 1.0 && range_m() <= 200.0)) {
    return {StatusCode::kInvalidArgument,
            StrCat("maximum range ", range_m(), " m: expected 1 to 200")};
  }
  ATLAS_RETURN_IF_ERROR(deskew.Validate());
  if (deskew.deskewing != Deskewing::kOff && (shots || mode == LocalizationMode::kPaper)) {
    return {StatusCode::kInvalidArgument,
            "deskewing goes by the motion of the scans before: not of single shots, nor in mode "
            "paper"};
  }
  if (shots && shots->trials < 1) {
    return {StatusCode::kInvalidArgument, "trials 0: expected at least one"};
  }
  const StartOptions searched;
  if (shots && !(shots->translation_m <= searched.max_m)) {
    return {StatusCode::kInvalidArgument,
            StrCat("starts ", shots->translation_m, " m off: expected ", searched.max_m,
                   " at most; whoever is further off is to be relocalized")};
  }
  if (start) {
    if (shots || mode != LocalizationMode::kAtlas) {
      return {
          StatusCode::kInvalidArgument,
          "a start that is known to be near: only a drive that is tracked in mode atlas has it"};
    }
    PlacePrior prior;
    prior.radius_m = start->radius_m;
    prior.height_m = start->height_m;
    ATLAS_RETURN_IF_ERROR(prior.Validate());
  }
  if (monitor != nullptr && (shots || mode != LocalizationMode::kAtlas)) {
    return {StatusCode::kInvalidArgument,
            "contradictions: only a drive that is tracked in mode atlas shows them"};
  }
  return {};
}

Result<DriveLocalizationReport> LocalizeDrive(
    const DriveFolder& drive,
    const DriveLocalizationOptions& options,
    MapView& view,
    const std::function<void(const LocalizedScan&)>& on_scan) {
  if (Status status = options.Validate(); !status.ok()) return Error(std::move(status));
  if (Status status = options.deskew.Validate(drive); !status.ok()) return Error(std::move(status));
  const SurveyOptions survey_options = SurveyOptionsFor(options);
  const Result<DriveSurvey> survey = options.mode == LocalizationMode::kPaper
                                         ? SurveyDrive(drive, survey_options)
                                         : SurveySensor(drive, survey_options);
  if (!survey) return Error(survey.error());
  const auto deskewing = DecideDeskewing(options.deskew.deskewing, drive, *survey,
                                         DriveMotion(drive, options.deskew.revolution_s));
  if (!deskewing) return Error(deskewing.error());
  const auto localizer = MakeLocalizer(drive, *survey, options, deskewing->is_deskewed, view);
  if (!localizer) return Error(localizer.error());
  auto report = LocalizeDrive(drive, options, **localizer, on_scan);
  if (report) report->deskewing = *deskewing;
  return report;
}

Result<DriveLocalizationReport> LocalizeDrive(
    const DriveFolder& drive,
    const DriveLocalizationOptions& options,
    ScanLocalizer& localizer,
    const std::function<void(const LocalizedScan&)>& on_scan) {
  if (Status status = options.Validate(); !status.ok()) return Error(std::move(status));
  return DriveLocalization(drive, options, localizer, on_scan).Run();
}

}  // namespace atlas
