// How much a plan has done, counted as squares that were compared with a leg of the vehicle's way
// (some 20 ns each). Whoever may not do more than so much asks before doing it.
#pragma once

#include <cstddef>
#include <limits>

namespace atlas {

class PlanWork {
 public:
  explicit PlanWork(std::size_t most = std::numeric_limits<std::size_t>::max()) : most_(most) {}

  // False: that would be more than may be done, from now on; leave it.
  bool Take(std::size_t steps) {
    is_over_ = is_over_ || steps > most_ - done_;
    done_ += is_over_ ? 0 : steps;
    return !is_over_;
  }
  std::size_t done() const { return done_; }

 private:
  const std::size_t most_;
  std::size_t done_ = 0;
  bool is_over_ = false;
};

}  // namespace atlas
