// Many connections that keep to the rules and cost next to nothing: after their Hello some say no
// more, others send requests for the atlas's status at a byte a second. For one thread.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/base/status.h"
#include "proto/wire/frame.h"
#include "tests/bench/serving/load_socket.h"

namespace atlas::testing {

class QuietCrowd {
 public:
  using Clock = std::chrono::steady_clock;

  QuietCrowd(std::uint16_t port, const LoadTls* tls) : port_(port), tls_(tls) {}

  // Connects and greets, one after the other.
  Status Open(std::size_t idle, std::size_t slow);
  // To be called often: sends the bytes that are due, reads what came. Any end of a connection and
  // any reply but those that were asked for is an error.
  Status Tick();
  // All are there still, and the idle ones are answered when they ask.
  Status CheckAll();
  std::size_t slow_replies() const { return slow_replies_; }

 private:
  struct Member {
    std::unique_ptr<LoadSocket> socket;
    FrameDecoder replies;
    std::size_t sent = 0;     // bytes of the requests, in turn
    std::size_t awaited = 0;  // replies
  };

  Status Add(std::vector<Member>& members);
  Status SendNext(Member& member, std::size_t bytes);
  Status Read(Member& member);
  Status ReadUntilAnswered(Member& member);

  std::uint16_t port_;
  const LoadTls* tls_;
  Bytes request_;
  std::vector<Member> idle_;
  std::vector<Member> slow_;
  Clock::time_point begin_;
  std::size_t due_sent_ = 0;  // bytes of all slow ones since the beginning
  std::size_t slow_replies_ = 0;
};

}  // namespace atlas::testing
