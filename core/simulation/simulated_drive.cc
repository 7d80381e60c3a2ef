// Where the vehicle stops, and the cast from there.
#include "core/simulation/simulated_drive.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/base/hash_random.h"
#include "core/base/str_cat.h"
#include "core/geometry/motion_share.h"
#include "core/simulation/surface_pose.h"

namespace atlas {
namespace {

constexpr double kLaneJitter_m = 0.3;
constexpr double kThing_m = 10.0;  // nothing that moves reaches further from its middle

bool IsWithin(double value, double low, double high) {
  return value >= low && value <= high;  // false for NaN
}

Status ValidateSensor(const LidarSensor& sensor) {
  if (sensor.rings() == 0 || sensor.rings() > 256 || sensor.columns == 0 || sensor.columns > 8192) {
    return Status(StatusCode::kInvalidArgument,
                  StrCat("sensor: ", sensor.rings(), " rings x ", sensor.columns,
                         " columns, expected 1 to 256 x 1 to 8192"));
  }
  if (!IsWithin(sensor.max_range_m, 1.0, 500.0) || !IsWithin(sensor.min_range_m, 0.0, 10.0) ||
      !IsWithin(sensor.range_sigma_m, 0.0, 1.0)) {
    return Status(
        StatusCode::kInvalidArgument,
        StrCat("sensor: range ", sensor.min_range_m, " to ", sensor.max_range_m, " m, sigma ",
               sensor.range_sigma_m, " m, expected 0..10 to 1..500 m, 0..1 m"));
  }
  return {};
}

Status ValidateDrive(const DriveOptions& options) {
  if (!IsWithin(options.spacing_m, 0.05, 100.0)) {
    return Status(StatusCode::kInvalidArgument,
                  StrCat("scan spacing ", options.spacing_m, " m, expected 0.05 to 100"));
  }
  if (!IsWithin(options.sensor_height_m, 0.2, 5.0)) {
    return Status(StatusCode::kInvalidArgument,
                  StrCat("sensor height ", options.sensor_height_m, " m, expected 0.2 to 5"));
  }
  if (!IsWithin(options.scan_interval_s, 0.001, 60.0)) {
    return Status(StatusCode::kInvalidArgument,
                  StrCat("scan interval ", options.scan_interval_s, " s, expected 0.001 to 60"));
  }
  if (!IsWithin(options.revolution_s, 0.0, options.scan_interval_s)) {
    return Status(StatusCode::kInvalidArgument,
                  StrCat("a revolution of ", options.revolution_s, " s: expected 0 to ",
                         options.scan_interval_s, ", the time between scans"));
  }
  return ValidateSensor(options.sensor);
}

// Not with two wheels on a wall or beyond the edge of a ramp.
bool StandsBeside(const PathPoint& way, const Pose& T_world_car) {
  constexpr double kMaxStep_m = 0.3;
  constexpr double kMaxRoll = 0.04;  // the sine
  return std::abs(T_world_car.translation().z() - way.position.z()) < kMaxStep_m &&
         std::abs(T_world_car.linear()(2, 1)) < kMaxRoll;
}

}  // namespace

SimulatedDrive::SimulatedDrive(std::shared_ptr<const StaticWorld> still,
                               const DriveOptions& options)
    : options_(options), caster_(options.sensor), still_(std::move(still)) {}

Result<SimulatedDrive> SimulatedDrive::Create(SimulatedWorld world, const DriveOptions& options) {
  if (Status status = ValidateDrive(options); !status.ok()) {
    return Error(std::move(status));
  }
  SimulatedDrive drive(std::make_shared<const MeshWorld>(std::move(world.mesh)), options);
  std::vector<DrivePath> legs = std::move(world.legs);
  std::vector<DrivePath> oncoming_legs;
  oncoming_legs.reserve(legs.size());
  for (const DrivePath& leg : legs) {
    oncoming_legs.push_back(leg.Reversed());
  }
  if (options.seed % 2 == 1) {
    std::swap(legs, oncoming_legs);
  }
  const double left_m =
      world.lane_left_m +
      (options.seed == 0 ? 0.0 : HashRandom(options.seed).Uniform(-kLaneJitter_m, kLaneJitter_m));
  for (std::size_t leg = 0; leg < legs.size(); ++leg) {
    if (Status status = drive.AddLeg(legs[leg], leg, left_m); !status.ok()) {
      return Error(status.WithContext(StrCat("drive, leg ", leg)));
    }
  }
  drive.AddConvoy(legs, left_m);
  drive.traffic_ = std::make_shared<const Traffic>(
      std::move(world.traffic), std::move(legs), std::move(oncoming_legs), world.parked_slots,
      TrafficOptions{options.seed, options.parked_seed});
  return drive;
}

Result<SimulatedDrive> SimulatedDrive::Create(TrajectoryWorld world,
                                              std::vector<DriveMoment> moments,
                                              const DriveOptions& options) {
  if (Status status = ValidateDrive(options); !status.ok()) {
    return Error(std::move(status));
  }
  SimulatedDrive drive(std::move(world.still), options);
  for (std::size_t i = 0; i < moments.size(); ++i) {
    drive.AddStop(moments[i]);
  }
  drive.AddConvoy(world.legs, 0.0);
  std::vector<DrivePath> oncoming_legs;
  for (const DrivePath& leg : world.legs) {
    oncoming_legs.push_back(leg.Reversed());
  }
  drive.traffic_ = std::make_shared<const Traffic>(
      std::move(world.traffic), std::move(world.legs), std::move(oncoming_legs), world.parked_slots,
      TrafficOptions{options.seed, options.parked_seed});
  return drive;
}

// From one leg to the next it goes straight, as fast as along them.
void SimulatedDrive::AddStop(const DriveMoment& moment) {
  if (stops_.empty()) {
    stops_.push_back({moment, 0.0});
    return;
  }
  const Stop& last = stops_.back();
  const double way_m =
      (moment.T_world_sensor.translation() - last.moment.T_world_sensor.translation()).norm();
  double step_s = moment.leg_time_s - last.moment.leg_time_s;
  if (last.moment.leg == moment.leg) {
    length_m_ += way_m;
  } else {
    step_s = options_.scan_interval_s * std::max(1.0, way_m / options_.spacing_m);
  }
  stops_.push_back({moment, last.time_s + step_s});
}

Status SimulatedDrive::AddLeg(const DrivePath& path, std::size_t leg, double left_m) {
  const auto steps = static_cast<std::size_t>(path.length_m() / options_.spacing_m);
  for (std::size_t i = 0; i <= steps; ++i) {
    const double along_m = static_cast<double>(i) * options_.spacing_m;
    const PathPoint at = path.At(along_m, left_m);
    auto pose = PoseOnSurface(still_->Around(at.position, kThing_m), at, options_.sensor_height_m);
    if (!pose) {
      return pose.error();
    }
    const double leg_time_s = static_cast<double>(i) * options_.scan_interval_s;
    AddStop({*pose, leg, leg_time_s, along_m});
  }
  return {};
}

void SimulatedDrive::AddConvoy(const std::vector<DrivePath>& legs, double left_m) {
  for (Stop& stop : stops_) {
    DriveMoment& moment = stop.moment;
    for (const ConvoyCar& car : options_.convoy) {
      const double along_m = moment.along_m + car.ahead_m;
      if (moment.leg >= legs.size() || along_m < 0.0 || along_m > legs[moment.leg].length_m()) {
        continue;
      }
      const PathPoint at = legs[moment.leg].At(along_m, left_m + car.left_m);
      const auto pose = PoseOnSurface(still_->Around(at.position, kThing_m), at, 0.0);
      if (pose && StandsBeside(at, *pose)) {
        moment.T_world_convoy.push_back(*pose);
      }
    }
  }
}

// None where another leg lies between.
std::optional<Pose> SimulatedDrive::Moved(std::size_t from, std::size_t to, double seconds) const {
  const Stop& a = stops_[from];
  const Stop& b = stops_[to];
  if (a.moment.leg != b.moment.leg) return std::nullopt;
  const Pose motion = a.moment.T_world_sensor.inverse() * b.moment.T_world_sensor;
  return ShareOf(motion, seconds / (b.time_s - a.time_s));
}

Pose SimulatedDrive::SensorPoseAfter(std::size_t i, double seconds) const {
  const bool has_next = i + 1 < scans();
  std::optional<Pose> moved;
  if (has_next && seconds >= 0.0) moved = Moved(i, i + 1, seconds);
  if (!moved && i > 0) moved = Moved(i, i - 1, seconds);
  if (!moved && has_next) moved = Moved(i, i + 1, seconds);
  return sensor_pose(i) * moved.value_or(Pose::Identity());
}

std::vector<Pose> SimulatedDrive::PosesDuring(std::size_t i) const {
  if (options_.revolution_s == 0.0) return {sensor_pose(i)};
  std::vector<Pose> poses;
  for (std::size_t column = 0; column < options_.sensor.columns; ++column) {
    const double turned = 0.5 * options_.sensor.azimuth_rad(column) / std::numbers::pi;
    poses.push_back(SensorPoseAfter(i, -(turned - std::round(turned)) * options_.revolution_s));
  }
  return poses;
}

// As far as it may drive on during a scan, too.
WorldParts SimulatedDrive::PartsAround(std::size_t i) const {
  const double driven_m =
      std::max(DrivenIn(i, -0.5 * options_.revolution_s), DrivenIn(i, 0.5 * options_.revolution_s));
  return still_->Around(sensor_pose(i).translation(), options_.sensor.max_range_m + driven_m);
}

double SimulatedDrive::DrivenIn(std::size_t i, double seconds) const {
  return (SensorPoseAfter(i, seconds).translation() - sensor_pose(i).translation()).norm();
}

// Of the middles of things that a ray may hit.
double SimulatedDrive::TrafficRadius() const {
  return options_.sensor.max_range_m + kThing_m;
}

SimulatedScan SimulatedDrive::Scan(std::size_t i) const {
  const WorldParts parts = PartsAround(i);
  const Eigen::Vector3d origin = parts.empty() ? sensor_pose(i).translation() : parts[0]->origin_m;
  const CastableMesh traffic = traffic_->MeshAround(stops_[i].moment, TrafficRadius(), origin);
  return caster_.Cast(parts, traffic, PosesDuring(i), {options_.seed, i});
}

SimulatedScan SimulatedDrive::StillScan(std::size_t i, const ScanCaster& caster) const {
  return caster.Cast(PartsAround(i), {}, {&sensor_pose(i), 1}, {options_.seed, i});
}

}  // namespace atlas
