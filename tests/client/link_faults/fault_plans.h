// Draws what goes wrong with a link, connection by connection: the same for the same seed, in the
// order in which connections come.
#pragma once

#include <chrono>
#include <cstdint>
#include <random>

#include "tests/client/support/link_proxy.h"

namespace atlas::testing {

struct FaultOptions {
  std::int64_t max_bytes_up = 8'000;    // a cut that way comes after at most so many
  std::int64_t max_bytes_down = 2'000;  // and this way
  std::chrono::milliseconds max_stall{300};
  std::chrono::milliseconds max_refused{100};
};

class FaultPlans {
 public:
  explicit FaultPlans(std::uint32_t seed, const FaultOptions& options = {})
      : random_(seed), options_(options) {}

  LinkPlan operator()();

 private:
  std::uint32_t Below(std::uint32_t count) { return static_cast<std::uint32_t>(random_() % count); }
  LinkPace DrawPace();
  LinkCut DrawCut(std::int64_t max_bytes);

  std::mt19937 random_;
  FaultOptions options_;
};

}  // namespace atlas::testing
