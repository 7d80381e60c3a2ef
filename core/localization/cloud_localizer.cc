#include "core/localization/cloud_localizer.h"

#include <utility>

#include "core/geometry/motion_share.h"
#include "core/keyframe/keyframe_builder.h"

namespace atlas {

CloudLocalizer::CloudLocalizer(const MapProfile& profile,
                               SensorLayout layout,
                               TilesAround tiles,
                               const CloudLocalizerOptions& options,
                               RelocalizerSource relocalizer)
    : layout_(std::move(layout)),
      options_(options),
      localizer_(profile, std::move(tiles), options.localizer, std::move(relocalizer)) {}

void CloudLocalizer::Start(const Pose& T_world_sensor, const StartKnowledge& known) {
  localizer_.Start(T_world_sensor, known);
}

Result<LocalizationResult> CloudLocalizer::Localize(const PointCloud& cloud,
                                                    const Eigen::Quaterniond& R_level_sensor,
                                                    double scans) {
  if (layout_.channels() == 0) {
    return Error(StatusCode::kInvalidArgument,
                 "localizer: the sensor's layout has no channel; SensorLayoutEstimator learns it");
  }
  leveled_ =
      SegmentScan(cloud, layout_, options_.ring_step, R_level_sensor, {}, DuringRevolution());
  return localizer_.Localize(leveled_, R_level_sensor, scans);
}

std::optional<Pose> CloudLocalizer::DuringRevolution() const {
  if (!options_.revolutions) {
    return std::nullopt;
  }
  return ShareOf(localizer_.T_now_later(), 1.0 / *options_.revolutions);
}

}  // namespace atlas
