// Until when the next frame of a peer has to be there: a while when nothing of it has come. One
// that has begun has to come at the slowest rate that is borne, and may stay behind it for a while:
// what came fast buys no more than that. So a large upload over a slow link gets through, and
// neither a peer that trickles nor one that stalls does.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>

#include "server/net/net_options.h"

namespace atlas {

class FrameClock {
 public:
  using Time = std::chrono::steady_clock::time_point;

  FrameClock(Time now, const NetOptions& options)
      : options_(options), deadline_(now + options.handshake) {}

  // Something came; `part_bytes` are there of a frame that is not whole yet.
  void Expect(Time now, std::size_t part_bytes) {
    const std::size_t before_bytes = part_bytes_;
    part_bytes_ = part_bytes;
    if (part_bytes == 0) {
      deadline_ = now + options_.idle;
      return;
    }
    deadline_ =
        before_bytes == 0
            ? now + options_.frame
            : std::min(now + options_.frame,
                       deadline_ + TimeFor(part_bytes - std::min(part_bytes, before_bytes)));
  }
  // Nobody listened meanwhile.
  void Restart(Time now, std::size_t part_bytes) {
    part_bytes_ = 0;
    Expect(now, part_bytes);
  }

  bool is_mid_frame() const { return part_bytes_ > 0; }
  Time deadline() const { return deadline_; }

 private:
  std::chrono::milliseconds TimeFor(std::size_t bytes) const {
    return std::chrono::milliseconds(1'000 * bytes / options_.min_bytes_per_s);
  }

  const NetOptions& options_;
  std::size_t part_bytes_ = 0;
  Time deadline_;
};

}  // namespace atlas
