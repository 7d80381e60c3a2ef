// Labelled triangles: what every simulated world is made of, and the ray test against one of them.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Geometry>

namespace atlas {

// Metres. float32 is exact to 0.02 mm within 200 m of the origin, where worlds are built.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint32_t> labels;  // truth_label.h, one a triangle

  // `other` moved by T_this_other.
  void Append(const TriangleMesh& other, const Eigen::Isometry3d& T_this_other);
};

struct MeshRay {
  Eigen::Vector3f origin = Eigen::Vector3f::Zero();
  Eigen::Vector3f direction = Eigen::Vector3f::UnitX();  // of length 1
};

struct MeshHit {
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  float distance_m = std::numeric_limits<float>::infinity();
  std::uint32_t triangle = kNone;

  bool is_hit() const { return triangle != kNone; }
};

// One corner and the two edges from it.
struct TriangleEdges {
  Eigen::Vector3f corner;
  Eigen::Vector3f edge1;
  Eigen::Vector3f edge2;
};
TriangleEdges EdgesOf(const TriangleMesh& mesh, std::uint32_t triangle);

// Distance along the ray, from either side, or infinity (Moeller and Trumbore 1997). Edges are
// widened by 1e-5 of the triangle, so that no ray slips between neighbours.
inline float IntersectTriangle(const MeshRay& ray, const TriangleEdges& triangle) {
  constexpr float kSlack = 1e-5F;
  constexpr float kMiss = std::numeric_limits<float>::infinity();
  const Eigen::Vector3f p = ray.direction.cross(triangle.edge2);
  const float determinant = triangle.edge1.dot(p);
  if (determinant == 0.0F) {
    return kMiss;
  }
  const float inverse = 1.0F / determinant;
  const Eigen::Vector3f to_origin = ray.origin - triangle.corner;
  const float u = to_origin.dot(p) * inverse;
  if (!(u >= -kSlack && u <= 1.0F + kSlack)) {
    return kMiss;
  }
  const Eigen::Vector3f q = to_origin.cross(triangle.edge1);
  const float v = ray.direction.dot(q) * inverse;
  if (!(v >= -kSlack && u + v <= 1.0F + kSlack)) {
    return kMiss;
  }
  const float distance_m = triangle.edge2.dot(q) * inverse;
  if (!(distance_m > 0.0F)) {
    return kMiss;
  }
  return distance_m;
}

}  // namespace atlas
