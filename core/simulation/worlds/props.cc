// The shapes of things, in metres.
#include "core/simulation/worlds/props.h"

namespace atlas {
namespace {

constexpr std::uint32_t kHouseLabel = TruthLabel(TruthClass::kBuilding);

}  // namespace

Eigen::Isometry3d FrameAt(const PathPoint& point) {
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  frame.linear() = Eigen::AngleAxisd(point.yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  frame.translation() = point.position;
  return frame;
}

std::vector<double> EvenlySpaced(double first, double end, double step) {
  std::vector<double> values;
  double value = first;
  while (value < end) {
    values.push_back(value);
    value = first + step * static_cast<double>(values.size());
  }
  return values;
}

TriangleMesh CarMesh(std::uint32_t label) {
  MeshBuilder car;
  car.Box({{-2.2, -0.9, 0.25}, {2.2, 0.9, 0.9}}, label);
  car.Box({{-1.5, -0.8, 0.9}, {0.9, 0.8, 1.5}}, label);
  for (const double x : {-1.35, 1.35}) {
    for (const double y : {-0.8, 0.8}) {
      car.Box({{x - 0.3, y - 0.1, 0.0}, {x + 0.3, y + 0.1, 0.6}}, label);
    }
  }
  return car.Take();
}

TriangleMesh PersonMesh(std::uint32_t label) {
  MeshBuilder person;
  person.Box({{-0.2, -0.25, 0.0}, {0.2, 0.25, 1.45}}, label);
  person.Box({{-0.12, -0.1, 1.45}, {0.12, 0.1, 1.75}}, label);
  return person.Take();
}

void AddTree(const Eigen::Vector3d& base, double crown_radius_m, MeshBuilder& out) {
  constexpr double kTrunk_m = 3.2;
  out.Cylinder(base, 0.18, kTrunk_m, TruthLabel(TruthClass::kTrunk));
  out.Ball(base + Eigen::Vector3d(0.0, 0.0, kTrunk_m + 0.6 * crown_radius_m), crown_radius_m,
           TruthLabel(TruthClass::kVegetation));
}

void AddPole(const Eigen::Vector3d& base, double height_m, std::uint32_t deck, MeshBuilder& out) {
  out.Cylinder(base, 0.09, height_m, TruthLabel(TruthClass::kPole, deck));
}

void AddSign(const Eigen::Isometry3d& T_world_sign, MeshBuilder& out) {
  AddPole(T_world_sign.translation(), 2.4, 0, out);
  out.Box({{0.1, -0.3, 2.0}, {0.13, 0.3, 2.6}}, T_world_sign, TruthLabel(TruthClass::kTrafficSign));
}

void AddHouse(const Eigen::Isometry3d& T_world_front, const HouseSize& size, MeshBuilder& out) {
  const double w = 0.5 * size.width_m;
  const double d = size.depth_m;
  const double h = size.height_m;
  out.Box({{-w, 0.0, 0.0}, {w, d, h}}, T_world_front, kHouseLabel);
  const auto at = [&](double x, double y, double z) -> Eigen::Vector3d {
    return T_world_front * Eigen::Vector3d(x, y, z);
  };
  const double ridge = h + 0.35 * d;
  out.Quad(at(-w, 0.0, h), at(w, 0.0, h), at(w, d / 2.0, ridge), at(-w, d / 2.0, ridge),
           kHouseLabel);
  out.Quad(at(-w, d, h), at(w, d, h), at(w, d / 2.0, ridge), at(-w, d / 2.0, ridge), kHouseLabel);
  // The porch makes fronts differ from each other.
  out.Box({{-1.0, -1.2, 0.0}, {1.0, 0.0, 0.4 * h}}, T_world_front, kHouseLabel);
}

}  // namespace atlas
