// Which places where two sessions seem to meet can all be true: pairwise consistency (Mangelson et
// al., "Pairwise consistent measurement set maximization", ICRA 2018). A wrong one agrees with
// hardly any other.
#pragma once

#include <cstddef>
#include <numbers>
#include <span>
#include <vector>

#include "core/geometry/pose.h"

namespace atlas {

// A session as its own odometry has it.
struct SessionWay {
  std::vector<Pose> T_session_submap;
  std::vector<double> way_m;  // driven until there, rising
};

// Submap `b` of one session lies at T_a_b in submap `a` of another, or of the same one.
struct Closure {
  std::size_t a = 0;
  std::size_t b = 0;
  Pose T_a_b = Pose::Identity();
  double weight = 0.0;  // how much speaks for it
};

// Two of them agree when each puts the other's submap where it was found, as well as both and the
// ways between them are known.
struct ConsistencyOptions {
  double distance_m = 0.3;
  double drift = 0.01;  // of the way, of an odometry as SessionWay has it
  double height_m = 0.2;
  double height_drift = 0.005;
  double yaw_rad = 1.0 * std::numbers::pi / 180.0;
  double yaw_drift_rad_a_m = 0.5 * std::numbers::pi / 180.0 / 100.0;
  std::size_t max_closures = 400;  // the weightiest are looked at
};

struct SessionPair {
  const SessionWay& a;
  const SessionWay& b;
};

bool AreConsistent(const Closure& one,
                   const Closure& other,
                   const SessionPair& sessions,
                   const ConsistencyOptions& options);

// Indices of closures that all agree with each other, rising: as much weight as a greedy search
// finds. Then of those that agree with none of the sets before, and so on, `most` sets in all:
// other ways in which the sessions might meet. None is empty.
std::vector<std::vector<std::size_t>> ConsistentSets(std::span<const Closure> closures,
                                                     const SessionPair& sessions,
                                                     const ConsistencyOptions& options,
                                                     std::size_t most);

double WeightOf(std::span<const Closure> closures, std::span<const std::size_t> set);

}  // namespace atlas
