// Poses from the wheels' contacts with the surface, traffic by time, and the cast.
#include "core/simulation/simulated_drive.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/base/hash_random.h"
#include "core/base/str_cat.h"
#include "core/simulation/worlds/props.h"

namespace atlas {
namespace {

// Wheels of a small car, seen from its middle.
constexpr double kHalfWheelbase_m = 1.35;
constexpr double kHalfTrack_m = 0.75;
// The surface is looked for from this far above the leg down to this far below that.
constexpr double kLookFrom_m = 1.2;
constexpr double kLookDown_m = 2.4;
constexpr double kLaneJitter_m = 0.3;

Result<Eigen::Vector3d> SurfaceBelow(const MeshBvh& world, const Eigen::Vector3d& p) {
  MeshRay ray;
  ray.origin = (p + Eigen::Vector3d(0.0, 0.0, kLookFrom_m)).cast<float>();
  ray.direction = -Eigen::Vector3f::UnitZ();
  const MeshHit hit = world.Cast(ray, static_cast<float>(kLookDown_m));
  if (!hit.is_hit()) {
    return Error(StatusCode::kInternal,
                 StrCat("no surface below (", p.x(), ", ", p.y(), ", ", p.z(), ") m"));
  }
  return Eigen::Vector3d(p.x(), p.y(), p.z() + kLookFrom_m - static_cast<double>(hit.distance_m));
}

// Front left, front right, rear left, rear right.
Result<std::array<Eigen::Vector3d, 4>> WheelContacts(const MeshBvh& world, const PathPoint& at) {
  const Eigen::Isometry3d frame = FrameAt(at);
  std::array<Eigen::Vector3d, 4> contacts;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const double x = i < 2 ? kHalfWheelbase_m : -kHalfWheelbase_m;
    const double y = i % 2 == 0 ? kHalfTrack_m : -kHalfTrack_m;
    auto contact = SurfaceBelow(world, frame * Eigen::Vector3d(x, y, 0.0));
    if (!contact) {
      return Error(contact.error());
    }
    contacts[i] = *contact;
  }
  return contacts;
}

Result<Pose> PoseOnSurface(const MeshBvh& world, const PathPoint& at, double height_m) {
  const auto ground = SurfaceBelow(world, at.position);
  const auto wheels = WheelContacts(world, at);
  if (!ground || !wheels) {
    return Error(ground ? wheels.error() : ground.error());
  }
  const auto& [front_left, front_right, rear_left, rear_right] = *wheels;
  const Eigen::Vector3d x = (front_left + front_right - rear_left - rear_right).normalized();
  const Eigen::Vector3d across = front_left + rear_left - front_right - rear_right;
  const Eigen::Vector3d z = x.cross(across).normalized();
  Pose pose = Pose::Identity();
  pose.linear().col(0) = x;
  pose.linear().col(1) = z.cross(x);
  pose.linear().col(2) = z;
  pose.translation() = *ground + Eigen::Vector3d(0.0, 0.0, height_m);
  return pose;
}

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
  return ValidateSensor(options.sensor);
}

}  // namespace

SimulatedDrive::SimulatedDrive(SimulatedWorld world, const DriveOptions& options)
    : options_(options),
      caster_(options.sensor),
      static_world_(std::move(world.mesh)),
      traffic_(std::move(world.traffic)),
      lane_left_m_(world.lane_left_m) {
  const bool is_reverse = options.seed % 2 == 1;
  for (const DrivePath& leg : world.legs) {
    legs_.push_back(is_reverse ? leg.Reversed() : leg);
    oncoming_legs_.push_back(is_reverse ? leg : leg.Reversed());
  }
}

Result<SimulatedDrive> SimulatedDrive::Create(SimulatedWorld world, const DriveOptions& options) {
  if (Status status = ValidateDrive(options); !status.ok()) {
    return Error(std::move(status));
  }
  SimulatedDrive drive(std::move(world), options);
  const double jitter_m =
      options.seed == 0 ? 0.0 : HashRandom(options.seed).Uniform(-kLaneJitter_m, kLaneJitter_m);
  for (std::size_t leg = 0; leg < drive.legs_.size(); ++leg) {
    if (Status status = drive.AddLeg(leg, drive.lane_left_m_ + jitter_m); !status.ok()) {
      return Error(status.WithContext(StrCat("drive, leg ", leg)));
    }
  }
  return drive;
}

Status SimulatedDrive::AddLeg(std::size_t leg, double left_m) {
  const DrivePath& path = legs_[leg];
  const auto steps = static_cast<std::size_t>(path.length_m() / options_.spacing_m);
  for (std::size_t i = 0; i <= steps; ++i) {
    const PathPoint at = path.At(static_cast<double>(i) * options_.spacing_m, left_m);
    auto pose = PoseOnSurface(static_world_.bvh, at, options_.sensor_height_m);
    if (!pose) {
      return pose.error();
    }
    if (i > 0) {
      length_m_ += (pose->translation() - stops_.back().T_world_sensor.translation()).norm();
    }
    stops_.push_back({*pose, leg, i});
  }
  return {};
}

CastableMesh SimulatedDrive::TrafficAt(const Stop& stop) const {
  TriangleMesh mesh;
  const double time_s = static_cast<double>(stop.index_in_leg) * options_.scan_interval_s;
  for (std::size_t i = 0; i < traffic_.size(); ++i) {
    const TrafficParticipant& participant = traffic_[i];
    const DrivePath& path = (participant.is_oncoming ? oncoming_legs_ : legs_)[participant.leg];
    const double delay_m =
        options_.seed == 0 ? 0.0 : HashRandom(options_.seed, i).Uniform(0.0, 8.0);
    const double along_m = participant.start_m + delay_m + participant.speed_m_s * time_s;
    if (participant.leg == stop.leg && along_m <= path.length_m()) {
      mesh.Append(participant.mesh, FrameAt(path.At(along_m, participant.left_m)));
    }
  }
  return CastableMesh(std::move(mesh));
}

SimulatedScan SimulatedDrive::Scan(std::size_t i) const {
  return caster_.Cast(static_world_, TrafficAt(stops_[i]), stops_[i].T_world_sensor,
                      {options_.seed, i});
}

}  // namespace atlas
