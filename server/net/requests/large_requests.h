// Requests that take long to be read, for their size. It happens on a thread for these, one after
// the other, that stands back a little: neither whoever shares the connection's thread waits for
// it, nor who waits for the disk, and no more than one takes the room that it takes unpacked.
#pragma once

#include <cstddef>
#include <memory>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/thread_pool.hpp>

#include "core/base/status.h"
#include "proto/wire/frame.h"
#include "server/net/access/access_control.h"
#include "server/net/requests/freed_memory.h"
#include "server/net/requests/request.h"

namespace atlas {

// What a small request takes in memory, where that is far more than its frame: messages that are
// repeated and say little take eighty times their bytes. Else 0: the frame counts.
std::size_t UnfoldedBytes(const wire::Envelope& request, std::size_t frame_bytes);

class LargeRequests {
 public:
  struct Outcome {
    Request request;              // without what is held for it
    Status denied;                // not ok: its peer may not ask for that
    std::size_t bytes = 0;        // that it occupies
    std::size_t reply_bytes = 0;  // that the part of the reply may take that grows with it
  };

  // `freed` outlives this.
  explicit LargeRequests(FreedMemory& freed);
  LargeRequests(const LargeRequests&) = delete;
  LargeRequests& operator=(const LargeRequests&) = delete;
  ~LargeRequests() { Join(); }

  // Waits for what is under way. To be called while all that hear of it are there.
  void Join() { pool_.join(); }

  // For what else is to be done with them.
  boost::asio::thread_pool& pool() { return pool_; }
  // kInvalidData: a wrong checksum, or no request.
  boost::asio::awaitable<Result<Outcome>> Read(LargeFrame frame, Identity identity);

 private:
  Result<Outcome> ReadNow(const LargeFrame& frame, const Identity& identity);
  std::shared_ptr<wire::Envelope> DestroyedHere(wire::Envelope message, std::size_t frame_bytes);

  FreedMemory& freed_;
  boost::asio::thread_pool pool_{1};
};

}  // namespace atlas
