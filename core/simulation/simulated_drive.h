// A drive through a simulated world: exact poses, and any scan of it on demand. Nothing is kept of
// a scan, so memory does not grow with the drive; scans may be asked for in any order and from
// several threads, and are the same on every run.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/base/status.h"
#include "core/geometry/pose.h"
#include "core/simulation/lidar_sensor.h"
#include "core/simulation/mesh/static_world.h"
#include "core/simulation/scan_caster.h"
#include "core/simulation/traffic.h"
#include "core/simulation/truth_box.h"
#include "core/simulation/worlds/simulated_world.h"

namespace atlas {

// A car that goes where the vehicle goes, tilted as the ground there is.
struct ConvoyCar {
  double ahead_m = 0.0;  // along the vehicle's way; negative: behind it
  double left_m = 0.0;   // of the vehicle's own track
};

// One ahead in the vehicle's track, and one behind beside it, over ground that the vehicle itself
// does not drive over.
constexpr ConvoyCar kCarAhead = {13.0, 0.0};
constexpr ConvoyCar kCarBehind = {-12.0, -2.1};

struct DriveOptions {
  LidarSensor sensor = Vlp16Sensor();
  // Even seeds drive the legs forward, odd ones in the other direction and lane. Seed 0 keeps to
  // the lane's middle, others up to 0.3 m beside it. Range noise and the traffic's places follow it
  // too; the world does not. Along a trajectory only noise and traffic do.
  std::uint64_t seed = 0;
  // Which of the world's parked slots hold a car: 0 none, else every other one by chance.
  std::uint64_t parked_seed = 0;
  std::vector<ConvoyCar> convoy = {};  // each wherever it finds ground to stand on
  double start_s = 0.0;                // of the first scan
  double spacing_m = 1.25;             // between scans, in plan, along the middle of the leg
  double sensor_height_m = 1.8;        // straight above the surface
  double scan_interval_s = 0.25;       // with the spacing: 18 km/h
  // How long the sensor takes to turn once, clockwise seen from above, while the vehicle drives on:
  // it looks ahead at the scan's pose, and a return at azimuth a, in (-pi, pi], is measured -a / 2
  // pi of that after it (core/scan/deskew.h). 0: all of a scan is seen at once.
  double revolution_s = 0.0;
};

// What a drive along a trajectory meets. Legs are the pieces of the trajectory, for traffic alone.
struct TrajectoryWorld {
  std::shared_ptr<const StaticWorld> still;
  std::vector<DrivePath> legs;
  std::vector<TrafficParticipant> traffic;
  std::vector<ParkedSlot> parked_slots;
};

class SimulatedDrive {
 public:
  // kInvalidArgument on options out of range; kInternal when a leg leaves the world's surface.
  static Result<SimulatedDrive> Create(SimulatedWorld world, const DriveOptions& options);
  // One scan a moment, its poses as given; `moments` name legs of the world.
  static Result<SimulatedDrive> Create(TrajectoryWorld world,
                                       std::vector<DriveMoment> moments,
                                       const DriveOptions& options);

  std::size_t scans() const { return stops_.size(); }
  double length_m() const { return length_m_; }  // sum over legs
  // T_world_sensor of scan i. Requires i < scans().
  const Pose& sensor_pose(std::size_t i) const { return stops_[i].moment.T_world_sensor; }
  // So much later, earlier below 0, on the way to the next scan or from the last one at an even
  // pace; where the leg ends, as fast as there.
  Pose SensorPoseAfter(std::size_t i, double seconds) const;
  double time_s(std::size_t i) const { return options_.start_s + stops_[i].time_s; }
  SimulatedScan Scan(std::size_t i) const;
  // What is there all the time, cast by another sensor: no traffic, no cars of this drive.
  SimulatedScan StillScan(std::size_t i, const ScanCaster& caster) const;

  // Truth: what moves, where it is during scan i (nothing moves within a scan), as far as the
  // sensor may reach it, and the cars that are parked in this drive and may be gone in another.
  std::vector<TruthBox> moving_boxes(std::size_t i) const {
    return traffic_->MovingBoxes(stops_[i].moment, TrafficRadius());
  }
  const std::vector<TruthBox>& parked_boxes() const { return traffic_->parked_boxes(); }

  const StaticWorld& still_world() const { return *still_; }

 private:
  struct Stop {
    DriveMoment moment;
    double time_s = 0.0;
  };

  SimulatedDrive(std::shared_ptr<const StaticWorld> still, const DriveOptions& options);
  Status AddLeg(const DrivePath& path, std::size_t leg, double left_m);
  void AddStop(const DriveMoment& moment);
  void AddConvoy(const std::vector<DrivePath>& legs, double left_m);
  std::vector<Pose> PosesDuring(std::size_t i) const;
  std::optional<Pose> Moved(std::size_t from, std::size_t to, double seconds) const;
  double DrivenIn(std::size_t i, double seconds) const;
  WorldParts PartsAround(std::size_t i) const;
  double TrafficRadius() const;

  DriveOptions options_;
  ScanCaster caster_;
  std::shared_ptr<const StaticWorld> still_;
  std::shared_ptr<const Traffic> traffic_;
  std::vector<Stop> stops_;
  double length_m_ = 0.0;
};

}  // namespace atlas
