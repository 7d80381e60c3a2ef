// One way of a connection that a LinkProxy passes on: so many bits a second, each byte late by a
// latency, up to a byte behind which nothing comes any more.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>

#include <poll.h>

#include "core/base/bytes.h"

namespace atlas {

struct LinkPace {
  double bits_per_s = 0.0;               // 0: as fast as they come
  std::chrono::milliseconds latency{0};  // one way
};

// Where a way ends: exactly so many bytes are passed on. Or, with a stall, it rests there, and ends
// after as many bytes more.
struct LinkCut {
  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();
  enum class Kind {
    kClose,      // both ways
    kReset,      // both ways, by a reset to both ends
    kHalfClose,  // the taking end is told that that was all; the other way goes on
  };

  std::int64_t after_bytes = kNever;
  Kind kind = Kind::kClose;
  std::chrono::milliseconds stall{0};
};

class LinkWay {
 public:
  using Clock = std::chrono::steady_clock;

  // The sockets do not block, and outlive the way.
  LinkWay(int from, int to, const LinkPace& pace, const LinkCut& cut);

  // What to wait for at either end.
  short ReadEvents() const { return MayRead() ? POLLIN : 0; }
  short WriteEvents() const { return IsDue() ? POLLOUT : 0; }
  // When there is something to do without an event.
  Clock::time_point due() const;

  void Read();
  // What has arrived by now, appended to `passed` if there is one.
  void Deliver(Bytes* passed);

  // Nothing comes any more, and the taking end knows.
  bool is_over() const { return is_told_; }
  // Since it came.
  std::optional<LinkCut::Kind> cut() const { return cut_kind_; }
  bool ends_both() const {
    return cut_kind_ == LinkCut::Kind::kClose || cut_kind_ == LinkCut::Kind::kReset;
  }
  std::uint64_t stalls() const { return stalls_; }
  bool is_broken() const { return is_broken_; }  // an end is gone
  std::uint64_t passed_bytes() const { return passed_bytes_; }

 private:
  struct Packet {
    Clock::time_point due;
    Bytes bytes;
    std::size_t sent = 0;
  };

  bool MayRead() const;
  bool IsDue() const { return !packets_.empty() && packets_.front().due <= Clock::now(); }
  void Strike();

  int from_;
  int to_;
  LinkPace pace_;
  LinkCut cut_;
  std::int64_t left_;          // until the cut
  Clock::time_point free_at_;  // when all that was read has left
  std::deque<Packet> packets_;
  std::optional<LinkCut::Kind> cut_kind_;
  bool has_ended_ = false;  // nothing is read any more
  bool is_told_ = false;
  bool is_broken_ = false;
  std::uint64_t stalls_ = 0;
  std::uint64_t passed_bytes_ = 0;
};

}  // namespace atlas
