// Things that stand in worlds: cars, trees, poles, houses, people.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

#include "core/simulation/drive_path.h"
#include "core/simulation/truth_label.h"
#include "core/simulation/worlds/mesh_builder.h"

namespace atlas {

// A frame on the ground at a path's point: x along it, y to the left.
Eigen::Isometry3d FrameAt(const PathPoint& point);

// first, first + step, ... below end. Requires a positive step.
std::vector<double> EvenlySpaced(double first, double end, double step);

// 4.4 m x 1.8 m x 1.5 m, x forward, origin on the ground under its middle, 0.25 m off it.
TriangleMesh CarMesh(std::uint32_t label);
// 0.5 m x 0.5 m x 1.75 m.
TriangleMesh PersonMesh(std::uint32_t label);

// `base` is on the ground.
void AddTree(const Eigen::Vector3d& base, double crown_radius_m, MeshBuilder& out);
void AddPole(const Eigen::Vector3d& base, double height_m, std::uint32_t deck, MeshBuilder& out);
// A pole with a sign of 0.6 m x 0.6 m that faces along x of the frame.
void AddSign(const Eigen::Isometry3d& T_world_sign, MeshBuilder& out);

// Walls and a gable roof; the frame's origin is at the middle of the front, x along it, y into it.
struct HouseSize {
  double width_m = 10.0;
  double depth_m = 8.0;
  double height_m = 5.5;
};
void AddHouse(const Eigen::Isometry3d& T_world_front, const HouseSize& size, MeshBuilder& out);

}  // namespace atlas
