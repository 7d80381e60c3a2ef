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
                                 const DriveOptions& options = {}) {
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
  DriveOptions with_traffic;
  with_traffic.has_car_ahead = true;
  if (name == "mesh_garage" || name == "mesh_garage_with_traffic") {
    return DriveMesh(data / "meshes/parking_garage.obj", data / "sim_garage_A/poses.txt",
                     name == "mesh_garage" ? DriveOptions() : with_traffic);
  }
  if (name == "mesh_interchange") {
    return DriveMesh(data / "meshes/cloverleaf_interchange.obj", data / "sim_overpass_A/poses.txt");
  }
  const bool is_without_cars = name == "street_without_cars";
  const bool has_traffic = name == "garage_with_traffic";
  const Result<WorldKind> kind = WorldKindByName(is_without_cars ? "street"
                                                 : has_traffic   ? "garage"
                                                                 : name);
  if (!kind) return Error(kind.error());
  Result<SimulatedWorld> world = MakeWorld(*kind);
  if (!world) return Error(world.error());
  if (is_without_cars) RemoveCars(world->mesh);
  return SimulatedDrive::Create(*std::move(world), has_traffic ? with_traffic : DriveOptions());
}

}  // namespace atlas::testing
