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
  if (!options_.revolutions) {
    return localizer_.Localize(leveled_, R_level_sensor, scans);
  }
  const PoseCovariance blur = Blur();
  auto result = localizer_.LocalizeDeskewed(leveled_, R_level_sensor, scans, *options_.revolutions);
  if (result) result->covariance += blur;
  return result;
}

// What a motion that is not known as it is makes of a place by way of deskewing.
PoseCovariance CloudLocalizer::Blur() const {
  constexpr double kShare = 0.1;  // of the motion's error: 0.10 and 0.12 on a street (0605)
  const double share = kShare / *options_.revolutions;
  return share * share * localizer_.MotionCovariance();
}

std::optional<Pose> CloudLocalizer::DuringRevolution() const {
  if (!options_.revolutions) {
    return std::nullopt;
  }
  return ShareOf(localizer_.T_now_later(), 1.0 / *options_.revolutions);
}

}  // namespace atlas
