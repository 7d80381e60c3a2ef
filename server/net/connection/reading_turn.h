// How a connection waits for what its peer sends, and lets the others of its thread have their turn
// when that comes without a pause.
#pragma once

#include <chrono>
#include <cstddef>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/deferred.hpp>
#include <boost/asio/post.hpp>

#include "server/net/stream/peer_stream.h"

namespace atlas {

class ReadingTurn {
 public:
  // `stream` outlives this.
  explicit ReadingTurn(PeerStream& stream) : stream_(stream) {}

  // After each read, whatever it gave: until another one is worth it, or `stop` is emitted.
  boost::asio::awaitable<void> Next(PeerStream::Moved came, boost::asio::cancellation_slot stop) {
    bytes_ += came.bytes;
    ++reads_;
    if (!came.is_blocked && bytes_ < kBytesInTurn && reads_ < kReadsInTurn) {
      return GoOn();
    }
    bytes_ = 0;
    reads_ = 0;
    return came.is_blocked ? stream_.WaitUntilReadable(stop) : Pass();
  }

 private:
  // Of one peer that has more. A read may give one byte: a record of TLS that has no others.
  static constexpr std::size_t kBytesInTurn = 256u << 10;
  static constexpr int kReadsInTurn = 64;

  static boost::asio::awaitable<void> GoOn() { co_return; }
  boost::asio::awaitable<void> Pass() {
    co_await boost::asio::post(stream_.executor(), boost::asio::deferred);
  }

  PeerStream& stream_;
  std::size_t bytes_ = 0;  // in this turn
  int reads_ = 0;          // likewise
};

// How long the requests of one peer, of which many came at once, are answered before it is the
// others' turn.
class AnsweringTurn {
 public:
  explicit AnsweringTurn(PeerStream& stream) : stream_(stream) {}

  bool IsOver() const { return Clock::now() - began_ >= kLength; }
  boost::asio::awaitable<void> Pass() {
    co_await boost::asio::post(stream_.executor(), boost::asio::deferred);
    began_ = Clock::now();
  }

 private:
  using Clock = std::chrono::steady_clock;

  static constexpr std::chrono::microseconds kLength{250};

  PeerStream& stream_;
  Clock::time_point began_ = Clock::now();
};

}  // namespace atlas
