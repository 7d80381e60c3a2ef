// A link that breaks: one connection passed on to a daemon until so many bytes came back.
#pragma once

#include <cstdint>
#include <thread>

#include "client/connection/endpoint.h"

namespace atlas {

class CutProxy {
 public:
  CutProxy(const Endpoint& daemon, std::int64_t bytes_until_cut);
  ~CutProxy();
  CutProxy(const CutProxy&) = delete;
  CutProxy& operator=(const CutProxy&) = delete;
  CutProxy(CutProxy&&) = delete;
  CutProxy& operator=(CutProxy&&) = delete;

  Endpoint endpoint() const { return {"127.0.0.1", port_}; }

 private:
  void Run(std::uint16_t daemon_port, std::int64_t bytes_left) const;

  int listener_ = -1;
  std::uint16_t port_ = 0;
  std::thread thread_;
};

}  // namespace atlas
