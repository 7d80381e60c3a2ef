#include "client/cli/commands/drive/simulation_request.h"

#include <algorithm>
#include <cctype>
#include <utility>

#include "core/base/str_cat.h"
#include "core/scan/drive_folder.h"
#include "core/simulation/city/city_world.h"
#include "core/simulation/mesh/mesh_labels.h"
#include "core/simulation/mesh/obj_reader.h"
#include "core/simulation/trajectory.h"

namespace atlas {
namespace {

constexpr std::uint64_t kMaxDay = 20'000;  // later ones are not over yet
constexpr double kDay_s = 86'400.0;

// Whether a file is a mesh, by its name, in letters of either case.
bool IsObjName(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return name.ends_with(".obj");
}

Result<Trajectory> ReadTrajectory(const std::string& path, const TrajectoryOptions& options) {
  const Result<std::vector<Pose>> poses = ReadPoses(path);
  if (!poses) return Error(poses.error());
  Result<Trajectory> trajectory = PlanTrajectory(*poses, options);
  if (!trajectory) return Error(trajectory.error().WithContext(path));
  return trajectory;
}

}  // namespace

void SimulationRequest::Declare(ArgumentSet& arguments) {
  arguments.Required("WORLD", "street|overpass|garage|city|FILE.obj", world_,
                     "Where the drive goes; a city grows along any trajectory");
  arguments.Choice("--sensor", {"vlp16", "hdl32", "hdl64", "h350"}, sensor_, "The LiDAR");
  arguments.Optional("--seed", "K", seed_,
                     "Noise and traffic; without a trajectory the lane, too, and odd ones drive in "
                     "the other direction [0]");
  arguments.Optional(
      "--parked", "K", parked_seed_,
      "The visit of day K: its times begin at K days, and it fills free slots of the "
      "street or city with parked cars of its own [0: none]");
  arguments.Flag("--traffic", has_traffic_,
                 "In a garage or mesh: a car 13 m ahead and one 12 m behind (the other worlds have "
                 "traffic anyway)");
  arguments.Optional("--trajectory", "FILE", trajectory_,
                     "Sensor poses to drive along, 12 numbers a line as in poses.txt");
  arguments.Optional("--every", "M", every_m_,
                     "Least distance between scans along a trajectory [0: every pose]");
  arguments.Optional(
      "--revolution", "S", revolution_s_,
      "The sensor turns once in so many seconds, clockwise, while the vehicle drives "
      "on; it looks ahead at the scan's pose [0: all of a scan is seen at once]");
}

Result<SimulatedDrive> SimulationRequest::MakeDrive() const {
  const Result<DriveOptions> options = Options();
  if (!options) return Error(options.error());
  if (is_mesh()) return DriveMesh(*options);
  return is_city() ? DriveAnyCity(*options) : DriveBuiltIn(*options);
}

bool SimulationRequest::is_mesh() const {
  return IsObjName(world_);
}

Result<DriveOptions> SimulationRequest::Options() const {
  DriveOptions options;
  Result<LidarSensor> sensor = LidarSensorByName(sensor_);
  if (!sensor) return Error(sensor.error());
  options.sensor = *std::move(sensor);
  options.seed = seed_;
  if (parked_seed_ > kMaxDay) {
    return Error(StatusCode::kInvalidArgument,
                 StrCat("--parked ", parked_seed_, ": expected a day up to ", kMaxDay));
  }
  options.parked_seed = parked_seed_;
  if (has_traffic_) options.convoy = {kCarAhead, kCarBehind};
  options.start_s = kDay_s * static_cast<double>(parked_seed_);
  if (!trajectory_.empty()) options.scan_interval_s = TrajectoryOptions().interval_s;
  options.revolution_s = revolution_s_;
  return options;
}

Result<SimulatedDrive> SimulationRequest::DriveBuiltIn(const DriveOptions& options) const {
  const Result<WorldKind> kind = WorldKindByName(world_);
  if (!kind) {
    return Error(StatusCode::kInvalidArgument,
                 StrCat("world '", world_,
                        "': expected street, overpass, garage, city or the name of an .obj file"));
  }
  if (!trajectory_.empty() || every_m_ != 0.0) {
    return Error(StatusCode::kInvalidArgument,
                 StrCat("the ", world_,
                        " has its own way: --trajectory and --every are for city and FILE.obj"));
  }
  if (parked_seed_ != 0 && *kind != WorldKind::kStreet) {
    return Error(NoFreeSlots());
  }
  if (has_traffic_ && *kind != WorldKind::kGarage) return Error(HasTraffic());
  Result<SimulatedWorld> world = MakeWorld(*kind);
  if (!world) return Error(world.error());
  return SimulatedDrive::Create(*std::move(world), options);
}

Status SimulationRequest::NoFreeSlots() const {
  return {StatusCode::kInvalidArgument,
          StrCat(world_, " has no free slots: --parked is for street and city")};
}

Status SimulationRequest::HasTraffic() const {
  return {StatusCode::kInvalidArgument,
          StrCat(world_, " has traffic of its own: --traffic is for garage and FILE.obj")};
}

Result<SimulatedDrive> SimulationRequest::DriveAnyCity(const DriveOptions& options) const {
  if (has_traffic_) return Error(HasTraffic());
  if (trajectory_.empty() && every_m_ != 0.0) {
    return Error(StatusCode::kInvalidArgument,
                 "--every thins a trajectory: give --trajectory FILE");
  }
  if (trajectory_.empty()) return DriveCity(CityTour(options), options);
  const Result<Trajectory> trajectory =
      ReadTrajectory(trajectory_, {every_m_, options.scan_interval_s});
  if (!trajectory) return Error(trajectory.error());
  return DriveCity(*trajectory, options);
}

Result<SimulatedDrive> SimulationRequest::DriveMesh(const DriveOptions& options) const {
  if (trajectory_.empty()) {
    return Error(StatusCode::kInvalidArgument,
                 StrCat(world_, ": a mesh does not say where to drive: give --trajectory FILE"));
  }
  if (parked_seed_ != 0) return Error(NoFreeSlots());
  Result<Trajectory> trajectory = ReadTrajectory(trajectory_, {every_m_, options.scan_interval_s});
  if (!trajectory) return Error(trajectory.error());
  Result<ObjMesh> obj = ReadObj(world_);
  if (!obj) return Error(obj.error());
  LabelMesh(obj->mesh);
  TrajectoryWorld world;
  world.still = std::make_shared<const MeshWorld>(std::move(obj->mesh), obj->origin_m);
  world.legs = GroundBelow(*trajectory, options.sensor_height_m);
  return SimulatedDrive::Create(std::move(world), std::move(trajectory->moments), options);
}

}  // namespace atlas
