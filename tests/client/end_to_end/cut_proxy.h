// A link that breaks: one connection passed on to a daemon until so many bytes came back.
#pragma once

#include <cstdint>
#include <limits>
#include <thread>

#include "client/connection/endpoint.h"
#include "core/base/bytes.h"

namespace atlas {

class CutProxy {
 public:
  enum class Cut { kClose, kReset };
  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

  CutProxy(const Endpoint& daemon, std::int64_t bytes_until_cut, Cut cut = Cut::kClose);
  ~CutProxy();
  CutProxy(const CutProxy&) = delete;
  CutProxy& operator=(const CutProxy&) = delete;
  CutProxy(CutProxy&&) = delete;
  CutProxy& operator=(CutProxy&&) = delete;

  Endpoint endpoint() const { return {"127.0.0.1", port_}; }
  // All that came back, once the connection is over: close the client before.
  const Bytes& Passed();

 private:
  void Run(std::uint16_t daemon_port, std::int64_t bytes_left, Cut cut);
  bool PassBack(int from, int to, std::int64_t& bytes_left);

  int listener_ = -1;
  std::uint16_t port_ = 0;
  Bytes passed_;  // the thread's until it ended
  std::thread thread_;
};

}  // namespace atlas
