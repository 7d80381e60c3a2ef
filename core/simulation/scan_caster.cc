// Casting, range noise along the ray, and truth.
#include "core/simulation/scan_caster.h"

#include <cmath>
#include <utility>

#include "core/base/hash_random.h"

namespace atlas {
namespace {

struct LabelledHit {
  float distance_m = 0.0F;
  std::uint32_t label = 0;
  float incidence = 0.0F;
};

// The sensor while it casts a column.
struct Origin {
  Eigen::Matrix3f R_world_sensor;
  Eigen::Vector3d p_world;
  Eigen::Vector3f p_traffic;  // in the traffic's own frame
};

std::vector<Origin> OriginsOf(std::span<const Pose> T_world_sensor, const CastableMesh& traffic) {
  std::vector<Origin> origins;
  origins.reserve(T_world_sensor.size());
  for (const Pose& pose : T_world_sensor) {
    const Eigen::Vector3d& p_world = pose.translation();
    origins.push_back(
        {pose.linear().cast<float>(), p_world, (p_world - traffic.origin_m).cast<float>()});
  }
  return origins;
}

LabelledHit Describe(const WorldHit& hit) {
  const TriangleEdges edges = EdgesOf(hit.part->mesh, hit.hit.triangle);
  const Eigen::Vector3f normal = edges.edge1.cross(edges.edge2).normalized();
  return {hit.hit.distance_m, hit.label(), std::abs(normal.dot(hit.ray.direction))};
}

}  // namespace

ScanCaster::ScanCaster(LidarSensor sensor) : sensor_(std::move(sensor)) {
  directions_.reserve(sensor_.rings() * sensor_.columns);
  for (const double elevation_rad : sensor_.elevations_rad) {
    for (std::size_t column = 0; column < sensor_.columns; ++column) {
      const double azimuth_rad = sensor_.azimuth_rad(column);
      directions_.emplace_back(Eigen::Vector3d(std::cos(elevation_rad) * std::cos(azimuth_rad),
                                               std::cos(elevation_rad) * std::sin(azimuth_rad),
                                               std::sin(elevation_rad))
                                   .cast<float>());
    }
  }
}

SimulatedScan ScanCaster::Cast(const WorldParts& still,
                               const CastableMesh& traffic,
                               std::span<const Pose> T_world_sensor,
                               const ScanNoise& noise) const {
  SimulatedScan scan;
  scan.points.reserve(directions_.size());
  scan.labels.reserve(directions_.size());
  const std::vector<Origin> origins = OriginsOf(T_world_sensor, traffic);
  const auto max_range_m = static_cast<float>(sensor_.max_range_m);
  for (std::size_t i = 0; i < directions_.size(); ++i) {
    const Origin& origin = origins[origins.size() == 1 ? 0 : i % sensor_.columns];
    const Eigen::Vector3f direction = origin.R_world_sensor * directions_[i];
    WorldHit nearest = CastWorld(still, origin.p_world, direction, max_range_m);
    const MeshRay ray{origin.p_traffic, direction};
    const MeshHit moving = traffic.bvh.Cast(ray, nearest.hit.distance_m);
    if (moving.is_hit()) {
      nearest = {moving, &traffic, ray};
    }
    if (!nearest.is_hit()) {
      continue;
    }
    const LabelledHit hit = Describe(nearest);
    HashRandom random(noise.seed, noise.scan, i);
    const double range_m = hit.distance_m + sensor_.range_sigma_m * random.Gaussian();
    if (range_m < sensor_.min_range_m || range_m > sensor_.max_range_m) {
      continue;
    }
    const Eigen::Vector3f p = directions_[i] * static_cast<float>(range_m);
    scan.points.push_back({p.x(), p.y(), p.z(), hit.incidence});
    scan.labels.push_back(hit.label);
  }
  return scan;
}

}  // namespace atlas
