// What stands along a city's streets: fronts, fences, trees, poles, signs, parked cars.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/simulation/city/city_ground.h"
#include "core/simulation/city/city_path.h"
#include "core/simulation/worlds/mesh_builder.h"
#include "core/simulation/worlds/simulated_world.h"

namespace atlas {

// Everything whose node lies in the chunk; nothing stands on the way of any pass. Vertices are
// relative to `origin`.
void AddPlots(const CityPath& path,
              const CityChunk& chunk,
              const CityGround& ground,
              const Eigen::Vector3d& origin,
              MeshBuilder& out);

// Slots along one node that a drive's own cars may take, in the world frame.
void AddParkedSlots(const CityPath& path,
                    const CityChunk& chunk,
                    const CityGround& ground,
                    std::vector<ParkedSlot>& slots);

}  // namespace atlas
