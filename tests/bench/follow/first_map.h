// A vehicle without any map that connects over a slow link: when it has what.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "client/connection/endpoint.h"
#include "client/connection/sync_query.h"
#include "core/base/status.h"
#include "core/geometry/map_profile.h"
#include "tests/client/support/link_proxy.h"

namespace atlas::testing {

struct FirstMapOptions {
  Endpoint daemon;
  LinkPace link{256'000.0, std::chrono::milliseconds(50)};  // of a mobile network
  Eigen::Vector3d place_m = Eigen::Vector3d::Zero();        // of the sensor
  Eigen::Vector3d target_m = Eigen::Vector3d::Zero();       // ahead, to be planned to
  double radius_m = 100.0;
  SectionBits sections = kEverySection;
};

// Seconds from the attempt to connect on.
struct FirstMap {
  double connected_s = 0.0;  // greeted by the daemon
  // Every place of the disc where the atlas has a level-0 tile lies in a tile that the view has.
  std::optional<double> covered_s;
  std::uint64_t covered_bytes = 0;  // that came down the link until then
  std::optional<double> planned_s;  // a route to the target is found on the finest tiles held
  std::vector<double> complete_s;   // by level: its last tile in the disc came
  std::vector<std::uint64_t> tiles;
  std::vector<std::uint64_t> blob_bytes;
};

Result<FirstMap> TimeFirstMap(const FirstMapOptions& options);

}  // namespace atlas::testing
