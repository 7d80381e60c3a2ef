// Shapes that worlds are built of, appended to one mesh.
#pragma once

#include <cstdint>
#include <span>

#include <Eigen/Geometry>

#include "core/simulation/drive_path.h"
#include "core/simulation/mesh/triangle_mesh.h"

namespace atlas {

struct AxisBox {
  Eigen::Vector3d low = Eigen::Vector3d::Zero();
  Eigen::Vector3d high = Eigen::Vector3d::Zero();
};

// A corner of a cross-section, and the label of the strip from it to the next corner.
struct ProfileCorner {
  double left_m = 0.0;
  double up_m = 0.0;
  std::uint32_t label = 0;
};

class MeshBuilder {
 public:
  void Triangle(const Eigen::Vector3d& a,
                const Eigen::Vector3d& b,
                const Eigen::Vector3d& c,
                std::uint32_t label);
  void Quad(const Eigen::Vector3d& a,
            const Eigen::Vector3d& b,
            const Eigen::Vector3d& c,
            const Eigen::Vector3d& d,
            std::uint32_t label);
  // A level rectangle at box.high.z().
  void Floor(const AxisBox& box, std::uint32_t label);
  void Box(const AxisBox& box, std::uint32_t label);
  // A box in a frame of its own.
  void Box(const AxisBox& box, const Eigen::Isometry3d& T_world_box, std::uint32_t label);
  // Upright, eight-sided, open at both ends.
  void Cylinder(const Eigen::Vector3d& base, double radius_m, double height_m, std::uint32_t label);
  // An octahedron subdivided once: 32 triangles.
  void Ball(const Eigen::Vector3d& centre, double radius_m, std::uint32_t label);
  // Draws the cross-section along the path. Requires at least two corners.
  void Extrude(const DrivePath& path, std::span<const ProfileCorner> profile);
  void Append(const TriangleMesh& mesh, const Eigen::Isometry3d& T_world_mesh) {
    mesh_.Append(mesh, T_world_mesh);
  }

  TriangleMesh Take() { return std::move(mesh_); }

 private:
  std::uint32_t Vertex(const Eigen::Vector3d& position);
  void Triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t label);

  TriangleMesh mesh_;
};

}  // namespace atlas
