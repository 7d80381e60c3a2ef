// What a tile is worth to a vehicle, and where that places it among the others of a sync.
#pragma once

#include <cstdint>

#include "core/geometry/map_profile.h"

namespace atlas {

inline constexpr double kOfTheCover = 1e30;  // before everything else
inline constexpr double kLater = 1e-60;      // after everything else
// What a tile counts as, in bytes, at least and at most. From a level to the next finer one error
// times area falls to an eighth: bounds that are eight times apart keep a parent before its
// children, whatever all of them weigh. Of those of street scenes, most are within (22 KB a tile).
inline constexpr double kLeastBytes = 8'192.0;
inline constexpr double kMostBytes = 8.0 * kLeastBytes;

// By how much the map is off where it is of a level: the side of its cells, metres.
double GeometricError(std::uint8_t level, const MapProfile& profile);
// The error that a tile removes, over its area, at a distance from the vehicle and its way; a
// parent's is at least eight times its children's.
double TileWorth(const MapProfile& profile, std::uint8_t level, double distance_m);

}  // namespace atlas
