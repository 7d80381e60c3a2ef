// A drive through a simulated world: exact poses, and any scan of it on demand. Nothing is kept of
// a scan, so memory does not grow with the drive; scans may be asked for in any order and from
// several threads, and are the same on every run.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/status.h"
#include "core/geometry/pose.h"
#include "core/simulation/lidar_sensor.h"
#include "core/simulation/scan_caster.h"
#include "core/simulation/worlds/simulated_world.h"

namespace atlas {

struct DriveOptions {
  LidarSensor sensor = Vlp16Sensor();
  // Even seeds drive the legs forward, odd ones in the other direction and lane. Seed 0 keeps to
  // the lane's middle, others up to 0.3 m beside it. Range noise and the traffic's places follow it
  // too; the world does not.
  std::uint64_t seed = 0;
  double spacing_m = 1.25;        // between scans, in plan, along the middle of the leg
  double sensor_height_m = 1.8;   // straight above the surface
  double scan_interval_s = 0.25;  // with the spacing: 18 km/h
};

class SimulatedDrive {
 public:
  // kInvalidArgument on options out of range; kInternal when a leg leaves the world's surface.
  static Result<SimulatedDrive> Create(SimulatedWorld world, const DriveOptions& options);

  std::size_t scans() const { return stops_.size(); }
  double length_m() const { return length_m_; }  // sum over legs
  // T_world_sensor of scan i. Requires i < scans().
  const Pose& sensor_pose(std::size_t i) const { return stops_[i].T_world_sensor; }
  double time_s(std::size_t i) const { return static_cast<double>(i) * options_.scan_interval_s; }
  SimulatedScan Scan(std::size_t i) const;

  const TriangleMesh& world_mesh() const { return static_world_.mesh; }

 private:
  struct Stop {
    Pose T_world_sensor;
    std::size_t leg = 0;
    std::size_t index_in_leg = 0;
  };

  SimulatedDrive(SimulatedWorld world, const DriveOptions& options);
  Status AddLeg(std::size_t leg, double left_m);
  CastableMesh TrafficAt(const Stop& stop) const;

  DriveOptions options_;
  ScanCaster caster_;
  CastableMesh static_world_;
  std::vector<DrivePath> legs_;  // as driven
  std::vector<DrivePath> oncoming_legs_;
  std::vector<TrafficParticipant> traffic_;
  double lane_left_m_ = 0.0;
  std::vector<Stop> stops_;
  double length_m_ = 0.0;
};

}  // namespace atlas
