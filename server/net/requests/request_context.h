// What requests are answered from. Shared by all connections and their threads.
#pragma once

#include <boost/asio/thread_pool.hpp>

#include "server/net/requests/wait_places.h"
#include "server/service/atlas_service.h"

namespace atlas {

// All outlive the requests.
struct RequestContext {
  AtlasService& service;
  boost::asio::thread_pool& pool;          // for what may block
  boost::asio::thread_pool& reading_pool;  // for what reads the whole store, or fuses
  WaitPlaces places;                       // for what may wait long
};

}  // namespace atlas
