// Places for requests that may wait long, so that those who wait cannot crowd out those who work.
// Thread-safe.
#pragma once

#include <cstddef>

#include "core/base/status.h"
#include "core/base/str_cat.h"
#include "server/net/places.h"

namespace atlas {

class WaitPlaces {
 public:
  explicit WaitPlaces(std::size_t max_places) : places_(max_places) {}

  // kUnavailable when all are taken.
  Result<Places::Place> Take() {
    Places::Place place = places_.Take();
    if (place == nullptr) {
      return Error(StatusCode::kUnavailable, StrCat(places_.max_places(),
                                                    " waits, digests and verifications are under "
                                                    "way already; try again later"));
    }
    return place;
  }

 private:
  Places places_;
};

}  // namespace atlas
