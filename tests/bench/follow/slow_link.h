// A link of a mobile network: one connection passed on to a daemon, so many bits a second each way,
// each byte late by a latency, the first by a TCP handshake's way there and back, too.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <thread>

#include "client/connection/endpoint.h"

namespace atlas::testing {

struct SlowLinkOptions {
  double bits_per_s = 256'000.0;
  std::chrono::milliseconds latency{50};  // one way
};

class SlowLink {
 public:
  // Throws where there is no port to listen on.
  SlowLink(const Endpoint& daemon, const SlowLinkOptions& options);
  ~SlowLink();
  SlowLink(const SlowLink&) = delete;
  SlowLink& operator=(const SlowLink&) = delete;
  SlowLink(SlowLink&&) = delete;
  SlowLink& operator=(SlowLink&&) = delete;

  Endpoint endpoint() const { return {"127.0.0.1", port_}; }
  std::uint64_t bytes_down() const { return bytes_down_; }

 private:
  void Run(std::uint16_t daemon_port);

  SlowLinkOptions options_;
  int listener_ = -1;
  std::uint16_t port_ = 0;
  std::atomic<std::uint64_t> bytes_down_{0};
  std::thread thread_;
};

}  // namespace atlas::testing
