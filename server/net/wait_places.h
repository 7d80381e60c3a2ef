// Places for requests that may wait long, so that those who wait cannot crowd out those who work.
// For the network thread.
#pragma once

#include <cstddef>
#include <memory>

#include "core/base/status.h"
#include "core/base/str_cat.h"

namespace atlas {

class WaitPlaces {
 public:
  // Gives itself back when it is destroyed; may outlive the WaitPlaces.
  using Place = std::shared_ptr<const std::size_t>;

  explicit WaitPlaces(std::size_t max_places) : max_places_(max_places) {}

  // kUnavailable when all are taken.
  Result<Place> Take() {
    if (static_cast<std::size_t>(taken_.use_count()) > max_places_) {
      return Error(StatusCode::kUnavailable, StrCat(max_places_,
                                                    " waits, digests and verifications are under "
                                                    "way already; try again later"));
    }
    return Place(taken_);
  }

 private:
  std::size_t max_places_;
  Place taken_ = std::make_shared<const std::size_t>(0);  // one owner a place, besides this
};

}  // namespace atlas
