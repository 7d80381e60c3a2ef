// One ray against several parts.
#include "core/simulation/mesh/static_world.h"

namespace atlas {

WorldHit CastWorld(const WorldParts& parts,
                   const Eigen::Vector3d& origin_m,
                   const Eigen::Vector3f& direction,
                   float max_distance_m) {
  WorldHit nearest;
  nearest.hit.distance_m = max_distance_m;
  for (const auto& part : parts) {
    const MeshRay ray{(origin_m - part->origin_m).cast<float>(), direction};
    const MeshHit hit = part->bvh.Cast(ray, nearest.hit.distance_m);
    if (hit.is_hit()) {
      nearest = {hit, part.get(), ray};
    }
  }
  return nearest;
}

}  // namespace atlas
