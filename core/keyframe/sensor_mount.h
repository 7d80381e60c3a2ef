// How a LiDAR stands on its vehicle, found from segmented scans of a drive: the one thing about the
// vehicle that must be known to tell the ground below it, which the sensor does not see.
#pragma once

#include <span>
#include <vector>

#include <Eigen/Geometry>

#include "core/base/status.h"
#include "core/scan/leveled_scan.h"

namespace atlas {

struct SensorMount {
  double height_m = 1.73;  // vertically above the ground below the sensor
  // Unit length, sensor frame: at a right angle to the ground that the vehicle's wheels stand on.
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();

  // The angle between the sensor's z axis and `up`.
  double TiltDeg() const;
  // kInvalidArgument unless the height is within 0.1 and 10 m.
  Status Validate() const;
};

class SensorMountEstimator {
 public:
  // Fits a plane to the ground within 12 m ahead and behind and 1.5 m to the sides (pavements
  // beside a street lie a kerb higher); where none is seen within 25 m, then all around. Its height
  // at the sensor is right also where the ground slopes and is seen on one side only.
  // `R_level_sensor` as for LevelScan.
  void Add(const LeveledScan& scan, const Eigen::Quaterniond& R_level_sensor);

  // The medians over the half of the scans in which the ground was flattest. kInvalidData when no
  // ground was seen, or none where a vehicle's is.
  Result<SensorMount> Estimate() const;

 private:
  struct Ground {
    double height_m = 0.0;                          // of the sensor, vertically
    Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  // sensor frame
    double spread_m = 0.0;                          // root mean square distance of the returns
  };

  std::vector<Ground> grounds_;
};

}  // namespace atlas
