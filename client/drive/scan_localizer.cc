#include "client/drive/scan_localizer.h"

#include <memory>
#include <utility>

#include "client/drive/place_reader.h"
#include "client/drive/tiles_around.h"
#include "core/keyframe/keyframe_builder.h"
#include "core/localization/cloud_localizer.h"
#include "core/localization/icp/paper_localizer.h"

namespace atlas {
namespace {

// Reads the whole map when a vehicle is lost for the first time.
RelocalizerSource RelocalizerOf(MapView& view, const RelocalizerOptions& options) {
  return [&view, options, made = std::shared_ptr<const Relocalizer>()]() mutable
         -> Result<std::shared_ptr<const Relocalizer>> {
    if (made == nullptr) {
      auto places = ReadPlaces(view);
      if (!places) return Error(places.error());
      made = std::make_shared<const Relocalizer>(view.profile(), *std::move(places), TilesOf(view),
                                                 options);
    }
    return made;
  };
}

class AtlasScanLocalizer : public ScanLocalizer {
 public:
  AtlasScanLocalizer(const SensorLayout& layout,
                     const CloudLocalizerOptions& options,
                     MapView& view,
                     OnLocalization on_localization)
      : localizer_(view.profile(), layout, TilesOf(view), options, RelocalizerOf(view, {})),
        on_localization_(std::move(on_localization)) {}

  void Start(const Pose& T_world_sensor, const StartKnowledge& known) override {
    localizer_.Start(T_world_sensor, known);
  }

  Result<LocatedScan> Locate(const PointCloud& cloud,
                             const Eigen::Quaterniond& R_level_sensor,
                             double scans) override {
    const Result<LocalizationResult> result = localizer_.Localize(cloud, R_level_sensor, scans);
    if (!result) return Error(result.error());
    if (on_localization_) {
      Status status = on_localization_(localizer_.leveled(), R_level_sensor, *result);
      if (!status.ok()) return Error(std::move(status));
    }
    return LocatedScan{result->T_world_sensor, result->health, result->registration.fit,
                       result->covariance, result->cover};
  }

 private:
  CloudLocalizer localizer_;
  OnLocalization on_localization_;
};

class PaperScanLocalizer : public ScanLocalizer {
 public:
  PaperScanLocalizer(KeyframeBuilder builder, const PaperLocalizerOptions& options, MapView& view)
      : builder_(std::move(builder)), localizer_(view.profile(), TilesOf(view), options) {}

  void Start(const Pose& T_world_sensor, const StartKnowledge& /*known*/) override {
    localizer_.Start(T_world_sensor);
  }

  // The paper starts from the last pose, whenever that was.
  Result<LocatedScan> Locate(const PointCloud& cloud,
                             const Eigen::Quaterniond& R_level_sensor,
                             double /*scans*/) override {
    const Result<PaperLocalization> result =
        localizer_.Localize(builder_.Build(cloud, {R_level_sensor}), R_level_sensor);
    if (!result) return Error(result.error());
    const LocalizationHealth health =
        result->is_lost ? LocalizationHealth::kLost : LocalizationHealth::kGood;
    return LocatedScan{result->T_world_sensor, health, result->fit, std::nullopt, std::nullopt};
  }

 private:
  KeyframeBuilder builder_;
  PaperLocalizer localizer_;
};

}  // namespace

std::unique_ptr<ScanLocalizer> MakeAtlasLocalizer(const DriveSurvey& survey,
                                                  double max_range_m,
                                                  MapView& view,
                                                  std::optional<double> revolutions,
                                                  OnLocalization on_localization) {
  CloudLocalizerOptions options;
  options.localizer.features.max_range_m = static_cast<float>(max_range_m);
  options.ring_step = survey.ring_step;
  options.revolutions = revolutions;
  return std::make_unique<AtlasScanLocalizer>(survey.layout, options, view,
                                              std::move(on_localization));
}

Result<std::unique_ptr<ScanLocalizer>> MakePaperLocalizer(const DriveSurvey& survey,
                                                          double max_range_m,
                                                          MapView& view) {
  KeyframeBuilderOptions options;
  options.max_range_m = max_range_m;
  options.mount = survey.mount;
  options.ring_step = survey.ring_step;
  if (Status status = options.Validate(view.profile()); !status.ok()) {
    return Error(std::move(status));
  }
  PaperLocalizerOptions localizer;
  localizer.max_range_m = max_range_m;
  return std::make_unique<PaperScanLocalizer>(
      KeyframeBuilder(view.profile(), survey.layout, options), localizer, view);
}

}  // namespace atlas
