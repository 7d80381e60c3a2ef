#include "client/drive/scan_localizer.h"

#include <numbers>
#include <utility>

#include "client/map/cell_address.h"
#include "core/keyframe/keyframe_builder.h"
#include "core/localization/icp/paper_localizer.h"

namespace atlas {
namespace {

Result<std::vector<std::shared_ptr<const Tile>>> TilesAroundPlace(MapView& view,
                                                                  const Eigen::Vector3d& center,
                                                                  double radius_m) {
  const double reach_m = radius_m * std::numbers::sqrt2;  // the square's corners
  const Eigen::Vector2d place = center.head<2>();
  if (Status status = view.Load(place, reach_m, 0); !status.ok()) return Error(std::move(status));
  const auto ids = TilesInDisc(place, reach_m, 0, view.profile(), SIZE_MAX);
  if (!ids) return Error(ids.error());
  std::vector<std::shared_ptr<const Tile>> tiles;
  for (const TileId& id : *ids) {
    auto tile = view.Get(id);
    if (!tile) return Error(tile.error());
    if (*tile != nullptr) tiles.push_back(*std::move(tile));
  }
  return tiles;
}

TilesAround TilesOf(MapView& view) {
  return [&view](const Eigen::Vector3d& center, double radius_m) {
    return TilesAroundPlace(view, center, radius_m);
  };
}

class AtlasScanLocalizer : public ScanLocalizer {
 public:
  AtlasScanLocalizer(const DriveSurvey& survey, const LocalizerOptions& options, MapView& view)
      : survey_(survey), localizer_(view.profile(), TilesOf(view), options) {}

  void Start(const Pose& T_world_sensor) override { localizer_.Start(T_world_sensor); }

  Result<LocatedScan> Locate(const PointCloud& cloud,
                             const Eigen::Quaterniond& R_level_sensor) override {
    const LeveledScan leveled =
        SegmentScan(cloud, survey_.layout, survey_.ring_step, R_level_sensor, {});
    const Result<LocalizationResult> result = localizer_.Localize(leveled, R_level_sensor);
    if (!result) return Error(result.error());
    return LocatedScan{result->T_world_sensor, result->health, result->registration.fit,
                       result->covariance};
  }

 private:
  DriveSurvey survey_;
  Localizer localizer_;
};

class PaperScanLocalizer : public ScanLocalizer {
 public:
  PaperScanLocalizer(KeyframeBuilder builder, const PaperLocalizerOptions& options, MapView& view)
      : builder_(std::move(builder)), localizer_(view.profile(), TilesOf(view), options) {}

  void Start(const Pose& T_world_sensor) override { localizer_.Start(T_world_sensor); }

  Result<LocatedScan> Locate(const PointCloud& cloud,
                             const Eigen::Quaterniond& R_level_sensor) override {
    const Result<PaperLocalization> result =
        localizer_.Localize(builder_.Build(cloud, R_level_sensor), R_level_sensor);
    if (!result) return Error(result.error());
    const LocalizationHealth health =
        result->is_lost ? LocalizationHealth::kLost : LocalizationHealth::kGood;
    return LocatedScan{result->T_world_sensor, health, result->fit, std::nullopt};
  }

 private:
  KeyframeBuilder builder_;
  PaperLocalizer localizer_;
};

}  // namespace

std::unique_ptr<ScanLocalizer> MakeAtlasLocalizer(const DriveSurvey& survey,
                                                  double max_range_m,
                                                  MapView& view) {
  LocalizerOptions options;
  options.features.max_range_m = static_cast<float>(max_range_m);
  return std::make_unique<AtlasScanLocalizer>(survey, options, view);
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
