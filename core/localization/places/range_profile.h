// What a place looks like from a vehicle that stands there: in each direction how far away the
// nearest structure is, in two bands of height above the ground. It needs no heading to be compared
// (every one is tried) and is made of a scan as of the map's columns.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <Eigen/Core>

#include "core/localization/places/block_map.h"
#include "core/scan/leveled_scan.h"

namespace atlas {

struct RangeProfile {
  static constexpr std::size_t kSectors = 64;  // from the x axis on, counter-clockwise
  static constexpr std::size_t kBands = 2;     // vehicles and fences; houses and trees
  static constexpr double kReach_m = 50.0;
  static constexpr double kStep_m = kReach_m / 200.0;  // of a code
  static constexpr std::uint8_t kNothing = 200;        // within reach

  std::array<std::array<std::uint8_t, kSectors>, kBands> ranges{};
};

// `ground_z_m`: of the ground below the sensor, levelled frame.
RangeProfile ProfileOf(const LeveledScan& scan, double ground_z_m);
// At a place on the ground, world frame.
RangeProfile ProfileAt(const BlockMap& map, const Eigen::Vector3d& ground);

// How unlike two profiles are when the scan's is turned by `turn` sectors, counter-clockwise, into
// the map's frame: for each turn the sum over sectors of the difference of their ranges, each as
// far as 6 m: something stands before it, or is not there.
std::array<std::uint32_t, RangeProfile::kSectors> Differences(const RangeProfile& scan,
                                                              const RangeProfile& map);

}  // namespace atlas
