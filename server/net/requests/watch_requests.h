// Watches from their request to their end: how many there may be, and what all of them keep.
#pragma once

#include <boost/asio/awaitable.hpp>

#include "server/net/net_options.h"
#include "server/net/places.h"
#include "server/net/requests/freed_memory.h"
#include "server/net/requests/large_requests.h"
#include "server/net/requests/peer.h"
#include "server/net/requests/request.h"
#include "server/net/requests/watch_memory.h"
#include "server/net/requests/watch_reply.h"
#include "server/service/atlas_service.h"

namespace atlas {

// Shared by all connections and their threads.
class WatchRequests {
 public:
  // All outlive this.
  WatchRequests(AtlasService& service,
                LargeRequests& large,
                FreedMemory& freed,
                const NetOptions& options)
      : service_(service),
        large_(large),
        places_(options.max_watches),
        memory_(options.max_watched_bytes, freed) {}

  boost::asio::awaitable<void> Answer(Request request, Peer& peer);

 private:
  // One of `share`, too, unless that is null. kUnavailable.
  Result<Places::Place> TakePlace(PeerShare* share);
  // With a place, and counted by the peer.
  boost::asio::awaitable<Status> Follow(Request request, Peer& peer);
  boost::asio::awaitable<Result<WatchOrder>> Read(const Request& request);

  AtlasService& service_;
  LargeRequests& large_;
  Places places_;
  WatchMemory memory_;
};

}  // namespace atlas
