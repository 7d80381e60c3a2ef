// Joining meshes, and triangles as corner and edges.
#include "core/simulation/mesh/triangle_mesh.h"

namespace atlas {

void TriangleMesh::Append(const TriangleMesh& other, const Eigen::Isometry3d& T_this_other) {
  const auto offset = static_cast<std::uint32_t>(vertices.size());
  for (const Eigen::Vector3f& vertex : other.vertices) {
    vertices.emplace_back((T_this_other * vertex.cast<double>()).cast<float>());
  }
  for (const auto& [a, b, c] : other.triangles) {
    triangles.push_back({a + offset, b + offset, c + offset});
  }
  labels.insert(labels.end(), other.labels.begin(), other.labels.end());
}

TriangleEdges EdgesOf(const TriangleMesh& mesh, std::uint32_t triangle) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  const Eigen::Vector3f corner = mesh.vertices[a];
  return {corner, mesh.vertices[b] - corner, mesh.vertices[c] - corner};
}

}  // namespace atlas
