// What requests are answered from. Shared by all connections and their threads.
#pragma once

#include <boost/asio/thread_pool.hpp>

#include "server/net/requests/fair_pool.h"
#include "server/net/requests/wait_places.h"
#include "server/service/atlas_service.h"

namespace atlas {

// All outlive the requests.
struct RequestContext {
  AtlasService& service;
  boost::asio::thread_pool& pool;  // for what is short and may block
  FairPool& reply_pool;            // for replies of many frames, their plans above all
  FairPool& reading_pool;          // for what reads the whole store, or fuses
  WaitPlaces waits;                // for what only waits
  WaitPlaces works;                // for what reads the whole store, or fuses
};

}  // namespace atlas
