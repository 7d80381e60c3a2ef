// Connections that break every rule there is, or keep to all of them and cost as much as they can,
// or ask again and again for what takes longest to plan, or read nothing of what they ask for, be
// it much of the atlas or much about what they hold, each on a thread of its own: when the daemon
// has done with one, or it gave up, it comes again at once.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

#include "core/base/bytes.h"
#include "tests/bench/serving/load_socket.h"

namespace atlas::testing {

enum class Hostility { kBreakRules, kAskMuch, kAskWide, kNeverRead, kHoldUnread };

class HostileCrowd {
 public:
  // `tls`: every second one shakes hands first, the others do not even do that.
  // `token`: whose they are; empty: nobody's.
  HostileCrowd(std::uint16_t port,
               const LoadTls* tls,
               const std::string& token,
               std::size_t peers,
               Hostility how);
  HostileCrowd(const HostileCrowd&) = delete;
  HostileCrowd& operator=(const HostileCrowd&) = delete;
  ~HostileCrowd() { Stop(); }

  void Stop();
  // How often they came so far.
  std::uint64_t visits() const { return visits_; }
  // Of these, how often nobody opened: a daemon that is gone.
  std::uint64_t refused() const { return refused_; }

 private:
  void Misbehave(std::size_t number, const std::stop_token& stop);

  std::uint16_t port_;
  const LoadTls* tls_;
  const Bytes hello_;
  const Hostility how_;
  std::atomic<std::uint64_t> visits_ = 0;
  std::atomic<std::uint64_t> refused_ = 0;
  std::vector<std::jthread> threads_;
};

}  // namespace atlas::testing
