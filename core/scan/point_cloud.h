// One LiDAR revolution: returns in the sensor frame (x forward, z up), metres.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace atlas {

// In the order of the file or the driver: ring after ring. Returns only, no empty slots.
struct PointCloud {
  std::vector<Eigen::Vector3f> points;
  // Which of the file's entries are none of these, rising: where the sensor got nothing back.
  std::vector<std::uint32_t> dropped;

  std::size_t size() const { return points.size(); }
};

}  // namespace atlas
