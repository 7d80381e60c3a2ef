// How old the map is that a daemon serves: on a connection of its own, again and again, how long it
// takes until the tiles reflect what the atlas holds now.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/base/status.h"

namespace atlas::testing {

class MapAge {
 public:
  // Connects, and begins.
  static Result<MapAge> Start(std::uint16_t port);

  // Seconds, of each tenth of a second that of the wait then under way; the last one is waited for,
  // a minute at most.
  Result<std::vector<double>> Stop();

 private:
  struct Waiting;
  explicit MapAge(std::shared_ptr<Waiting> waiting) : waiting_(std::move(waiting)) {}

  std::shared_ptr<Waiting> waiting_;
};

}  // namespace atlas::testing
