// Places for requests that may wait long, so that those who wait cannot crowd out those who work.
// Thread-safe.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <utility>

#include "core/base/status.h"
#include "core/base/str_cat.h"
#include "server/net/peer_share.h"
#include "server/net/places.h"

namespace atlas {

class WaitPlaces {
 public:
  explicit WaitPlaces(std::size_t max_places) : places_(max_places) {}

  // One of `share`, too, unless that is null. kUnavailable when all are taken, and whose they are.
  Result<Places::Place> Take(PeerShare* share) {
    Places::Place own;
    if (share != nullptr) {
      own = share->waits.Take();
      if (own == nullptr) {
        return Error(Full(share->waits, StrCat(" of ", share->whose)));
      }
    }
    Places::Place place = places_.Take();
    if (place == nullptr) {
      return Error(Full(places_, ""));
    }
    return Places::Both(std::move(own), std::move(place));
  }

 private:
  static Status Full(const Places& places, const std::string& whose) {
    return {StatusCode::kUnavailable,
            StrCat(places.max_places(), " waits, digests and verifications", whose,
                   " are under way already; try again later")};
  }

  Places places_;
};

}  // namespace atlas
