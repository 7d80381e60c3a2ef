// A cell of the map's finest level by its place in the world.
#pragma once

#include <cmath>
#include <cstdint>

#include <Eigen/Core>

namespace atlas::testing {

struct MapCell {
  std::int32_t x = 0;
  std::int32_t y = 0;

  static MapCell At(const Eigen::Vector3d& p_world, double cell_m) {
    return {static_cast<std::int32_t>(std::floor(p_world.x() / cell_m)),
            static_cast<std::int32_t>(std::floor(p_world.y() / cell_m))};
  }
  Eigen::Vector2d Centre(double cell_m) const { return {(x + 0.5) * cell_m, (y + 0.5) * cell_m}; }

  friend bool operator==(const MapCell&, const MapCell&) = default;
};

struct MapCellHash {
  std::size_t operator()(const MapCell& cell) const {
    const std::uint64_t key = (std::uint64_t{static_cast<std::uint32_t>(cell.x)} << 32) |
                              static_cast<std::uint32_t>(cell.y);
    return (key ^ (key >> 29)) * 0xBF58476D1CE4E5B9U;
  }
};

}  // namespace atlas::testing
