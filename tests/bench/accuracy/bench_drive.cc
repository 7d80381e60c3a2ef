#include "tests/bench/accuracy/bench_drive.h"

#include <memory>
#include <utility>

#include "core/scan/drive_folder.h"
#include "core/simulation/mesh/mesh_labels.h"
#include "core/simulation/mesh/obj_reader.h"
#include "core/simulation/trajectory.h"
#include "core/simulation/truth_label.h"

namespace atlas::testing {
namespace {

Result<SimulatedDrive> DriveMesh(const std::filesystem::path& mesh,
                                 const std::filesystem::path& poses_file,
                                 const DriveOptions& options) {
  Result<ObjMesh> obj = ReadObj(mesh);
  if (!obj) return Error(obj.error());
  const Result<std::vector<Pose>> poses = ReadPoses(poses_file);
  if (!poses) return Error(poses.error());
  Result<Trajectory> trajectory = PlanTrajectory(*poses, {});
  if (!trajectory) return Error(trajectory.error());
  LabelMesh(obj->mesh);
  TrajectoryWorld world;
  world.still = std::make_shared<const MeshWorld>(std::move(obj->mesh), obj->origin_m);
  world.legs = GroundBelow(*trajectory, options.sensor_height_m);
  return SimulatedDrive::Create(std::move(world), std::move(trajectory->moments), options);
}

void RemoveCars(TriangleMesh& mesh) {
  TriangleMesh kept;
  kept.vertices = std::move(mesh.vertices);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (ClassOfLabel(mesh.labels[i]) != TruthClass::kCar) {
      kept.triangles.push_back(mesh.triangles[i]);
      kept.labels.push_back(mesh.labels[i]);
    }
  }
  mesh = std::move(kept);
}

}  // namespace

Result<SimulatedDrive> MakeBenchDrive(std::string_view name, const std::filesystem::path& data) {
  const auto takes = [&name](std::string_view suffix) {
    if (!name.ends_with(suffix)) return false;
    name.remove_suffix(suffix.size());
    return true;
  };
  DriveOptions options;
  if (takes("_with_traffic")) {
    options.convoy = {kCarAhead, kCarBehind};
  } else if (takes("_with_car_behind")) {
    options.convoy = {kCarBehind};
  }
  if (name == "mesh_garage") {
    return DriveMesh(data / "meshes/parking_garage.obj", data / "sim_garage_A/poses.txt", options);
  }
  if (name == "mesh_interchange") {
    return DriveMesh(data / "meshes/cloverleaf_interchange.obj", data / "sim_overpass_A/poses.txt",
                     options);
  }
  const bool is_without_cars = takes("_without_cars");
  const Result<WorldKind> kind = WorldKindByName(name);
  if (!kind) return Error(kind.error());
  Result<SimulatedWorld> world = MakeWorld(*kind);
  if (!world) return Error(world.error());
  if (is_without_cars) RemoveCars(world->mesh);
  return SimulatedDrive::Create(*std::move(world), options);
}

}  // namespace atlas::testing
