// Corners and triangles of each shape.
#include "core/simulation/worlds/mesh_builder.h"

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace atlas {
namespace {

constexpr int kCylinderSides = 8;
constexpr double kExtrudeStep_m = 0.5;

}  // namespace

std::uint32_t MeshBuilder::Vertex(const Eigen::Vector3d& position) {
  mesh_.vertices.emplace_back(position.cast<float>());
  return static_cast<std::uint32_t>(mesh_.vertices.size() - 1);
}

void MeshBuilder::Triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t label) {
  mesh_.triangles.push_back({a, b, c});
  mesh_.labels.push_back(label);
}

void MeshBuilder::Triangle(const Eigen::Vector3d& a,
                           const Eigen::Vector3d& b,
                           const Eigen::Vector3d& c,
                           std::uint32_t label) {
  const std::uint32_t ia = Vertex(a);
  const std::uint32_t ib = Vertex(b);
  Triangle(ia, ib, Vertex(c), label);
}

void MeshBuilder::Quad(const Eigen::Vector3d& a,
                       const Eigen::Vector3d& b,
                       const Eigen::Vector3d& c,
                       const Eigen::Vector3d& d,
                       std::uint32_t label) {
  const std::uint32_t ia = Vertex(a);
  const std::uint32_t ib = Vertex(b);
  const std::uint32_t ic = Vertex(c);
  const std::uint32_t id = Vertex(d);
  Triangle(ia, ib, ic, label);
  Triangle(ia, ic, id, label);
}

void MeshBuilder::Floor(const AxisBox& box, std::uint32_t label) {
  const double z = box.high.z();
  Quad({box.low.x(), box.low.y(), z}, {box.high.x(), box.low.y(), z},
       {box.high.x(), box.high.y(), z}, {box.low.x(), box.high.y(), z}, label);
}

void MeshBuilder::Box(const AxisBox& box, std::uint32_t label) {
  Box(box, Eigen::Isometry3d::Identity(), label);
}

void MeshBuilder::Box(const AxisBox& box,
                      const Eigen::Isometry3d& T_world_box,
                      std::uint32_t label) {
  std::array<Eigen::Vector3d, 8> corners;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    corners[i] = T_world_box * Eigen::Vector3d((i & 1) != 0 ? box.high.x() : box.low.x(),
                                               (i & 2) != 0 ? box.high.y() : box.low.y(),
                                               (i & 4) != 0 ? box.high.z() : box.low.z());
  }
  constexpr std::array<std::array<std::size_t, 4>, 6> faces = {
      {{0, 1, 3, 2}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 3, 7, 5}}};
  for (const auto& [a, b, c, d] : faces) {
    Quad(corners[a], corners[b], corners[c], corners[d], label);
  }
}

void MeshBuilder::Cylinder(const Eigen::Vector3d& base,
                           double radius_m,
                           double height_m,
                           std::uint32_t label) {
  const auto rim = [&](int i) -> Eigen::Vector3d {
    const double angle_rad = 2.0 * std::numbers::pi * i / kCylinderSides;
    return base + radius_m * Eigen::Vector3d(std::cos(angle_rad), std::sin(angle_rad), 0.0);
  };
  const Eigen::Vector3d up(0.0, 0.0, height_m);
  for (int i = 0; i < kCylinderSides; ++i) {
    Quad(rim(i), rim(i + 1), rim(i + 1) + up, rim(i) + up, label);
  }
}

void MeshBuilder::Ball(const Eigen::Vector3d& centre, double radius_m, std::uint32_t label) {
  const auto on_ball = [&](const Eigen::Vector3d& direction) {
    return Vertex(centre + radius_m * direction.normalized());
  };
  for (int octant = 0; octant < 8; ++octant) {
    const Eigen::Vector3d x((octant & 1) != 0 ? 1.0 : -1.0, 0.0, 0.0);
    const Eigen::Vector3d y(0.0, (octant & 2) != 0 ? 1.0 : -1.0, 0.0);
    const Eigen::Vector3d z(0.0, 0.0, (octant & 4) != 0 ? 1.0 : -1.0);
    const std::array<std::uint32_t, 3> tip{on_ball(x), on_ball(y), on_ball(z)};
    const std::array<std::uint32_t, 3> between{on_ball(x + y), on_ball(y + z), on_ball(z + x)};
    Triangle(tip[0], between[0], between[2], label);
    Triangle(tip[1], between[1], between[0], label);
    Triangle(tip[2], between[2], between[1], label);
    Triangle(between[0], between[1], between[2], label);
  }
}

void MeshBuilder::Extrude(const DrivePath& path, std::span<const ProfileCorner> profile) {
  const auto add_section = [&](double along_m) {
    std::vector<std::uint32_t> section;
    for (const ProfileCorner& corner : profile) {
      const Eigen::Vector3d position = path.At(along_m, corner.left_m).position;
      section.push_back(Vertex(position + Eigen::Vector3d(0.0, 0.0, corner.up_m)));
    }
    return section;
  };
  const int steps = static_cast<int>(std::ceil(path.length_m() / kExtrudeStep_m));
  std::vector<std::uint32_t> previous = add_section(0.0);
  for (int step = 1; step <= steps; ++step) {
    const std::vector<std::uint32_t> next = add_section(path.length_m() * step / steps);
    for (std::size_t i = 0; i + 1 < profile.size(); ++i) {
      Triangle(previous[i], next[i], next[i + 1], profile[i].label);
      Triangle(previous[i], next[i + 1], previous[i + 1], profile[i].label);
    }
    previous = next;
  }
}

}  // namespace atlas
