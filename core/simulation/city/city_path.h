// The way through a city: every pass of a trajectory on the ground, by place. The whole city is a
// function of it.
#pragma once

#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace atlas {

// Squares of 64 m that the plane is cut into.
struct CityChunk {
  static constexpr double kSize_m = 64.0;

  std::int32_t x = 0;
  std::int32_t y = 0;

  static CityChunk At(const Eigen::Vector2d& p);
  Eigen::AlignedBox2d Square() const;

  friend bool operator==(const CityChunk&, const CityChunk&) = default;
};

struct CityNode {
  Eigen::Vector3d ground = Eigen::Vector3d::Zero();  // below the sensor, as this pass saw it
  double yaw_rad = 0.0;
  double along_m = 0.0;  // of its leg
  std::uint32_t leg = 0;
  bool is_last = false;        // of its leg
  bool is_first_pass = false;  // no earlier pass came near: houses and trees are its own
};

class CityPath {
 public:
  // Nothing further than this from every node knows of it: less than a chunk's side.
  static constexpr double kReach_m = 45.0;

  // `legs`: positions of the sensor, 1 m or more apart, `sensor_height_m` above the ground.
  CityPath(std::span<const std::vector<Eigen::Vector3d>> legs, double sensor_height_m);

  const std::vector<CityNode>& nodes() const { return nodes_; }
  // Of a chunk, in order.
  std::span<const std::uint32_t> NodesIn(const CityChunk& chunk) const;
  // Those within kReach_m of the square, in a fixed order.
  std::vector<std::uint32_t> NodesNear(const Eigen::AlignedBox2d& square) const;

 private:
  void AddLeg(std::span<const Eigen::Vector3d> points, double sensor_height_m);
  void Index();
  void FindFirstPasses();

  std::vector<CityNode> nodes_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> by_chunk_;
};

}  // namespace atlas
