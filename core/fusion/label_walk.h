// Eq. 2 of the paper (III-C): an observation takes the label of one of its own session's
// representatives, the last before it or the first after it, whichever is closer in altitude.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <span>

#include "core/fusion/observation.h"
#include "core/fusion/segments.h"

namespace atlas {

// Walks the layer-making observations of a cell in canonical order.
class LabelWalk {
 public:
  LabelWalk(std::span<const Observation> observations,
            std::span<const Representative> representatives)
      : observations_(observations), representatives_(representatives) {}

  // The label of observation `index`, which belongs to `session`. Indices must rise from call to
  // call and every session asked for must have a representative.
  std::uint32_t Label(std::uint32_t index, std::uint32_t session) {
    while (next_ < representatives_.size() && representatives_[next_].observation <= index) {
      ++next_;
    }
    const bool has_before = next_ > 0 && representatives_[next_ - 1].session == session;
    const bool has_after =
        next_ < representatives_.size() && representatives_[next_].session == session;
    if (!has_after) {
      return representatives_[next_ - 1].layer;
    }
    if (!has_before) {
      return representatives_[next_].layer;
    }
    const bool after_is_closer = Difference(next_, index) < Difference(next_ - 1, index);
    return representatives_[after_is_closer ? next_ : next_ - 1].layer;
  }

 private:
  std::int64_t Difference(std::size_t representative, std::uint32_t index) const {
    const Observation& other = observations_[representatives_[representative].observation];
    return std::abs(std::int64_t{other.altitude_mm} - observations_[index].altitude_mm);
  }

  std::span<const Observation> observations_;
  std::span<const Representative> representatives_;
  std::size_t next_ = 0;  // the first representative after the observation
};

}  // namespace atlas
