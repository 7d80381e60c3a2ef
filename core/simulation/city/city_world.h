// A city built along a trajectory: streets, houses, trees and cars wherever the trajectory leads.
// Chunks are built when a scan first needs them and a bounded number is kept; a chunk depends on
// nothing but the trajectory.
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <vector>

#include "core/base/status.h"
#include "core/simulation/city/city_path.h"
#include "core/simulation/mesh/static_world.h"
#include "core/simulation/simulated_drive.h"
#include "core/simulation/trajectory.h"

namespace atlas {

class CityWorld : public StaticWorld {
 public:
  explicit CityWorld(CityPath path) : path_(std::move(path)) {}

  WorldParts Around(const Eigen::Vector3d& p_world, double radius_m) const override;

  const CityPath& path() const { return path_; }

 private:
  // A square of 8 x 8 chunks, wherever it lies, has a place for each.
  static constexpr std::int32_t kCacheSide = 8;
  struct Chunk;

  std::shared_ptr<const Chunk> ChunkAt(const CityChunk& place) const;

  CityPath path_;
  mutable std::array<std::atomic<std::shared_ptr<const Chunk>>, kCacheSide * kCacheSide> cache_;
};

// The drive along the trajectory through its city. All passes share one ground: where two come by
// at different heights (loops of recorded trajectories do) it lies between them, and paths that
// cross above each other meet. The sensor stands `options.sensor_height_m` above that ground, at
// the trajectory's place and heading, tilted as the ground is: the poses of the drive are these. A
// car drives 20 m ahead, others come towards every 90 m.
Result<SimulatedDrive> DriveCity(const Trajectory& trajectory, const DriveOptions& options);

// Twice around blocks that share a street: a way for those who have none.
Trajectory CityTour(const DriveOptions& options);

}  // namespace atlas
