// One scan: the sensor's rays against what stands and what moves.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/pose.h"
#include "core/simulation/lidar_sensor.h"
#include "core/simulation/mesh/static_world.h"

namespace atlas {

struct SimulatedPoint {
  float x = 0.0F;  // sensor frame, metres
  float y = 0.0F;
  float z = 0.0F;
  float intensity = 0.0F;  // cosine of the angle of incidence

  friend bool operator==(const SimulatedPoint&, const SimulatedPoint&) = default;
};

// Ring after ring, the lowest first, azimuth increasing from 0 to 2 pi within each; rays without a
// return are left out.
struct SimulatedScan {
  std::vector<SimulatedPoint> points;  // each in the sensor's frame as it was cast
  std::vector<std::uint32_t> labels;   // truth_label.h, one a point
};

struct ScanNoise {
  std::uint64_t seed = 0;
  std::uint64_t scan = 0;
};

// Casts a sensor's rays; directions are computed once.
class ScanCaster {
 public:
  explicit ScanCaster(LidarSensor sensor);

  // Where the sensor is during the scan: one pose for all of it, or one a column. Everything in
  // `traffic` stands still. Requires 1 or sensor().columns poses.
  SimulatedScan Cast(const WorldParts& still,
                     const CastableMesh& traffic,
                     std::span<const Pose> T_world_sensor,
                     const ScanNoise& noise) const;

  const LidarSensor& sensor() const { return sensor_; }

 private:
  LidarSensor sensor_;
  std::vector<Eigen::Vector3f> directions_;  // sensor frame, ring-major
};

}  // namespace atlas
