// Positions as a satellite receiver would have them: right but for noise, a part of which stays for
// a while.
#pragma once

#include <cstdint>
#include <span>

#include "core/base/status.h"
#include "core/geometry/pose.h"
#include "core/scan/position_file.h"

namespace atlas {

struct GnssOptions {
  double sigma_m = 0.5;  // one standard deviation along each axis, from 0.001 to 1000
  // So much of the variance wanders, as what atmosphere, orbits and reflections do to a receiver
  // does: a Gauss-Markov process that forgets within this time. The rest is new each time.
  double wandering = 0.5;
  double wandering_s = 30.0;
  std::uint64_t seed = 1;  // of the same seed the same noise

  // kInvalidArgument naming the first option out of range.
  Status Validate() const;
};

// Of poses T_world_sensor at `times_s`, as many and rising, by their numbers from 0; the radius of
// each is the options' sigma. Requires options that are valid.
KnownPlaces MeasuredPlaces(std::span<const Pose> T_world_sensor,
                           std::span<const double> times_s,
                           const GnssOptions& options);

}  // namespace atlas
