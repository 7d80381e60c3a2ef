// Vehicles that ask for maps of places all over an atlas, holding nothing: a load without pauses.
#pragma once

#include <chrono>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "client/connection/endpoint.h"
#include "core/base/status.h"

namespace atlas::testing {

struct ReadersOptions {
  Endpoint endpoint;
  std::vector<Eigen::Vector2d> places_m;
  int connections = 16;
  double radius_m = 100.0;
  std::chrono::milliseconds time{0};
};

struct ReadersReport {
  std::uint64_t syncs = 0;
  std::uint64_t queries = 0;  // every eighth request
  std::uint64_t tiles = 0;
  std::uint64_t bytes = 0;
};

// Each connection is a thread of its own and asks at places drawn with a fixed seed.
Result<ReadersReport> ReadMaps(const ReadersOptions& options);

}  // namespace atlas::testing
