// Chunks on demand, traffic, and the seat of the vehicle.
#include "core/simulation/city/city_world.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <unordered_set>

#include "core/base/str_cat.h"
#include "core/simulation/city/city_ground.h"
#include "core/simulation/city/city_plots.h"
#include "core/simulation/surface_pose.h"
#include "core/simulation/truth_label.h"
#include "core/simulation/worlds/props.h"

namespace atlas {
namespace {

constexpr double kOverhang_m = 24.0;  // houses and fences beyond their chunk
constexpr double kSeat_m = 4.0;       // the vehicle's wheels
constexpr double kLeading_m = 20.0;
constexpr double kOncomingStep_m = 90.0;
constexpr double kOncomingSpeed_m_s = 7.0;
constexpr double kOncomingLeft_m = -2.4;  // the right lane, as they drive

// What a chunk's things may stand on.
CityGround GroundAround(const CityPath& path, const CityChunk& place) {
  const Eigen::AlignedBox2d square = place.Square();
  const Eigen::Vector2d overhang = Eigen::Vector2d::Constant(kOverhang_m);
  return CityGround(path, {square.min() - overhang, square.max() + overhang});
}

CastableMesh BuildChunk(const CityPath& path, const CityChunk& place) {
  const Eigen::AlignedBox2d square = place.Square();
  const CityGround ground(path, square);
  const Eigen::Vector2d middle = square.center();
  const std::vector<std::uint32_t> near = path.NodesNear(square);
  const double z_m = near.empty() ? 0.0 : std::round(path.nodes()[near[0]].ground.z());
  const Eigen::Vector3d origin(middle.x(), middle.y(), z_m);
  MeshBuilder builder;
  if (!near.empty()) {
    ground.AddMesh(origin, builder);
    AddPlots(path, place, GroundAround(path, place), origin, builder);
  }
  return CastableMesh(builder.Take(), origin);
}

// The trajectory's legs laid on the ground.
std::vector<DrivePath> LegsOnGround(const CityPath& path) {
  std::vector<DrivePath> legs;
  std::vector<Eigen::Vector3d> points;
  for (const CityNode& node : path.nodes()) {
    const Eigen::Vector2d p = node.ground.head<2>();
    const double z_m = CityGround(path, {p, p}).At(p).road_z_m;
    points.emplace_back(p.x(), p.y(), z_m);
    if (node.is_last) {
      legs.push_back(DrivePath::Through(points));
      points.clear();
    }
  }
  return legs;
}

std::vector<TrafficParticipant> TrafficOn(const std::vector<DrivePath>& legs,
                                          const std::vector<DriveMoment>& moments) {
  std::vector<double> duration_s(legs.size(), 0.0);
  for (const DriveMoment& moment : moments) {
    duration_s[moment.leg] = std::max(duration_s[moment.leg], moment.leg_time_s);
  }
  std::vector<TrafficParticipant> traffic;
  const TriangleMesh car = CarMesh(TruthLabel(TruthClass::kMovingCar));
  for (std::size_t leg = 0; leg < legs.size(); ++leg) {
    TrafficParticipant leading{car, leg, false, kLeading_m, 0.0, 0.0, true};
    traffic.push_back(leading);
    const double first_m = -kOncomingSpeed_m_s * duration_s[leg];
    double start_m = legs[leg].length_m();
    while (start_m > first_m) {
      traffic.push_back({car, leg, true, start_m, kOncomingSpeed_m_s, kOncomingLeft_m, false});
      start_m -= kOncomingStep_m;
    }
  }
  return traffic;
}

std::vector<ParkedSlot> SlotsOf(const CityPath& path) {
  std::vector<ParkedSlot> slots;
  std::unordered_set<std::uint64_t> seen;
  for (const CityNode& node : path.nodes()) {
    const CityChunk place = CityChunk::At(node.ground.head<2>());
    const std::uint64_t key = (std::uint64_t{static_cast<std::uint32_t>(place.x)} << 32) |
                              static_cast<std::uint32_t>(place.y);
    if (seen.insert(key).second) {
      AddParkedSlots(path, place, GroundAround(path, place), slots);
    }
  }
  return slots;
}

// The same moments with the sensor where the ground puts it.
Status SeatOnGround(const CityWorld& city, double height_m, std::vector<DriveMoment>& moments) {
  for (std::size_t i = 0; i < moments.size(); ++i) {
    const Pose& given = moments[i].T_world_sensor;
    const Eigen::Vector2d p = given.translation().head<2>();
    PathPoint at;
    at.yaw_rad = std::atan2(given.linear()(1, 0), given.linear()(0, 0));
    at.position << p, CityGround(city.path(), {p, p}).At(p).road_z_m;
    const auto pose = PoseOnSurface(city.Around(at.position, kSeat_m), at, height_m);
    if (!pose) {
      return pose.error().WithContext(StrCat("trajectory, scan ", i));
    }
    moments[i].T_world_sensor = *pose;
  }
  return {};
}

}  // namespace

struct CityWorld::Chunk {
  CityChunk place;
  CastableMesh mesh;
};

std::shared_ptr<const CityWorld::Chunk> CityWorld::ChunkAt(const CityChunk& place) const {
  const auto slot = static_cast<std::size_t>((place.y & (kCacheSide - 1)) * kCacheSide +
                                             (place.x & (kCacheSide - 1)));
  std::shared_ptr<const Chunk> chunk = cache_[slot].load();
  if (!chunk || chunk->place != place) {
    chunk = std::make_shared<const Chunk>(Chunk{place, BuildChunk(path_, place)});
    cache_[slot].store(chunk);
  }
  return chunk;
}

WorldParts CityWorld::Around(const Eigen::Vector3d& p_world, double radius_m) const {
  const Eigen::Vector2d p = p_world.head<2>();
  const Eigen::Vector2d reach = Eigen::Vector2d::Constant(radius_m + kOverhang_m);
  const CityChunk low = CityChunk::At(p - reach);
  const CityChunk high = CityChunk::At(p + reach);
  WorldParts parts;
  for (std::int32_t y = low.y; y <= high.y; ++y) {
    for (std::int32_t x = low.x; x <= high.x; ++x) {
      const CityChunk place{x, y};
      if (place.Square().exteriorDistance(p) > radius_m + kOverhang_m) {
        continue;
      }
      const std::shared_ptr<const Chunk> chunk = ChunkAt(place);
      if (!chunk->mesh.mesh.triangles.empty()) {
        parts.emplace_back(chunk, &chunk->mesh);
      }
    }
  }
  std::stable_sort(parts.begin(), parts.end(), [&](const auto& a, const auto& b) {
    return (a->origin_m.template head<2>() - p).norm() <
           (b->origin_m.template head<2>() - p).norm();
  });
  return parts;
}

Result<SimulatedDrive> DriveCity(const Trajectory& trajectory, const DriveOptions& options) {
  const auto city =
      std::make_shared<const CityWorld>(CityPath(trajectory.legs, options.sensor_height_m));
  std::vector<DriveMoment> moments = trajectory.moments;
  if (Status status = SeatOnGround(*city, options.sensor_height_m, moments); !status.ok()) {
    return Error(std::move(status));
  }
  TrajectoryWorld world;
  world.legs = LegsOnGround(city->path());
  world.traffic = TrafficOn(world.legs, moments);
  world.parked_slots = SlotsOf(city->path());
  world.still = city;
  return SimulatedDrive::Create(std::move(world), std::move(moments), options);
}

Trajectory CityTour(const DriveOptions& options) {
  constexpr double kLong_m = 74.0;
  constexpr double kShort_m = 44.0;
  constexpr double kRise_m = 1.5;
  constexpr double kCorner_m = 8.0;
  DrivePath path({{0.0, 0.0, 0.0}, 0.0});
  for (const double quarter_rad : {0.5 * std::numbers::pi, -0.5 * std::numbers::pi}) {
    for (const double rise_m : {kRise_m, -kRise_m}) {
      path.Straight(kLong_m, rise_m)
          .Turn(kCorner_m, quarter_rad)
          .Straight(kShort_m)
          .Turn(kCorner_m, quarter_rad);
    }
  }
  std::vector<Pose> poses;
  for (const double along_m : EvenlySpaced(0.0, path.length_m(), options.spacing_m)) {
    Pose pose = FrameAt(path.At(along_m));
    pose.translation().z() += options.sensor_height_m;
    poses.push_back(pose);
  }
  return PlanTrajectory(poses, {0.0, options.scan_interval_s}).value();
}

}  // namespace atlas
