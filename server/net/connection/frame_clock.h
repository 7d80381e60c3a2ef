// Until when the next frame of a peer has to be there: a while when nothing of it has come; once it
// has begun, a shorter one, and as much more as what has come takes at the slowest rate that is
// borne. So a large upload over a slow link gets through, and a peer that trickles does not.
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>

#include "server/net/net_options.h"

namespace atlas {

class FrameClock {
 public:
  using Time = std::chrono::steady_clock::time_point;

  FrameClock(Time now, const NetOptions& options)
      : options_(options), deadline_(now + options.handshake) {}

  // Something came; `part_bytes` of it are of a frame that is not whole yet.
  void Expect(Time now, std::size_t part_bytes) {
    if (part_bytes == 0) {
      began_.reset();
      deadline_ = now + options_.idle;
      return;
    }
    began_ = began_.value_or(now);
    deadline_ = *began_ + options_.frame +
                std::chrono::milliseconds(1'000 * part_bytes / options_.min_bytes_per_s);
  }
  // Nobody listened meanwhile.
  void Restart(Time now, std::size_t part_bytes) {
    began_.reset();
    Expect(now, part_bytes);
  }

  bool is_mid_frame() const { return began_.has_value(); }
  Time deadline() const { return deadline_; }

 private:
  const NetOptions& options_;
  std::optional<Time> began_;  // of a frame of which a part has come
  Time deadline_;
};

}  // namespace atlas
