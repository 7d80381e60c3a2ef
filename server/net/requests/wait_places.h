// Places for requests that may last: those who only wait must not crowd out those who work, nor
// those who read the map whoever looks after it. Thread-safe.
#pragma once

#include <cstddef>
#include <string>
#include <utility>

#include "core/base/status.h"
#include "core/base/str_cat.h"
#include "server/net/peer_record.h"
#include "server/net/places.h"

namespace atlas {

class WaitPlaces {
 public:
  // `what` they are for, in messages. `of_name`: those that a name has of them. `kept` of
  // `max_places` are for merges and administrators alone.
  WaitPlaces(const char* what, Places PeerShare::*of_name, std::size_t max_places, std::size_t kept)
      : what_(what), of_name_(of_name), all_(max_places), open_(max_places - kept) {}

  // One of its name's, too, if it has one. kUnavailable when all are taken, and whose they are.
  Result<Places::Place> Take(const PeerRecord& peer) {
    Places::Place own;
    if (peer.share != nullptr) {
      Places& of_name = (*peer.share).*of_name_;
      own = of_name.Take();
      if (own == nullptr) {
        return Error(Full(of_name, StrCat(" of ", peer.share->whose)));
      }
    }
    Places::Place open;
    if (peer.role < Role::kMerge) {
      open = open_.Take();
      if (open == nullptr) {
        return Error(Full(open_, ""));
      }
    }
    Places::Place place = all_.Take();
    if (place == nullptr) {
      return Error(Full(all_, ""));
    }
    return Places::Both(Places::Both(std::move(own), std::move(open)), std::move(place));
  }

 private:
  Status Full(const Places& places, const std::string& whose) const {
    return {StatusCode::kUnavailable, StrCat(places.max_places(), " ", what_, whose,
                                             " are under way already; try again later")};
  }

  const char* const what_;
  Places PeerShare::*const of_name_;
  Places all_;
  Places open_;  // of these, for everybody
};

}  // namespace atlas
