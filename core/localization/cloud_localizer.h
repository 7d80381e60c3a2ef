// From a revolution's returns to where the vehicle is: segmentation, deskewing and the localizer.
#pragma once

#include <optional>

#include <Eigen/Geometry>

#include "core/base/status.h"
#include "core/localization/localizer.h"
#include "core/scan/leveled_scan.h"
#include "core/scan/point_cloud.h"
#include "core/scan/sensor_layout.h"

namespace atlas {

struct CloudLocalizerOptions {
  LocalizerOptions localizer;
  int ring_step = 1;  // use every ring_step-th channel from the lowest
  // How many revolutions the sensor makes from one scan to the next: scans are deskewed by the
  // predicted motion, and places are less sure as that is: the first two scans of a vehicle that
  // drives when it starts are some decimetres off. None: they are taken as they are, which is right
  // for those that are deskewed.
  std::optional<double> revolutions;
};

class CloudLocalizer {
 public:
  CloudLocalizer(const MapProfile& profile,
                 SensorLayout layout,
                 TilesAround tiles,
                 const CloudLocalizerOptions& options,
                 RelocalizerSource relocalizer = {});

  // As Localizer::Start.
  void Start(const Pose& T_world_sensor, const StartKnowledge& known = StartHint());

  // Requires Start(). `cloud` in the sensor's frame; `R_level_sensor` turns it upright, as an IMU
  // says, whatever its heading; `scans` as Localizer::Localize, which says how it fails.
  // kInvalidArgument: the layout has no channel.
  Result<LocalizationResult> Localize(const PointCloud& cloud,
                                      const Eigen::Quaterniond& R_level_sensor,
                                      double scans = 1.0);
  // The last cloud as it was matched, for a monitor.
  const LeveledScan& leveled() const { return leveled_; }

 private:
  std::optional<Pose> DuringRevolution() const;
  PoseCovariance Blur() const;

  SensorLayout layout_;
  CloudLocalizerOptions options_;
  Localizer localizer_;
  LeveledScan leveled_;
};

}  // namespace atlas
