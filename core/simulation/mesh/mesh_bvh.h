// A bounding volume hierarchy over one mesh: the nearest triangle along a ray. Built once by binned
// surface-area heuristic, then read by any number of threads.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

#include "core/simulation/mesh/triangle_mesh.h"

namespace atlas {

class MeshBvh {
 public:
  MeshBvh() = default;
  // Copies what it needs of the mesh. A mesh without triangles is never hit.
  explicit MeshBvh(const TriangleMesh& mesh);

  // The nearest hit closer than `max_distance_m`; of equally near ones, any but always the same.
  MeshHit Cast(const MeshRay& ray, float max_distance_m) const;

 private:
  struct Node {
    Eigen::Vector3f low;
    std::uint32_t first = 0;  // leaf: its first triangle; inner: its left child, the right one next
    Eigen::Vector3f high;
    std::uint32_t count = 0;  // triangles of a leaf, 0 for an inner node
  };
  struct Build;

  void CastLeaf(const Node& leaf, const MeshRay& ray, MeshHit& nearest) const;

  std::vector<Node> nodes_;
  std::vector<TriangleEdges> triangles_;  // in leaf order
  std::vector<std::uint32_t> index_;      // of triangles_ in the mesh
};

}  // namespace atlas
