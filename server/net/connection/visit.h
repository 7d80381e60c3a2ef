// A connection from when it is accepted until it is gone: what it takes of places and of the pace.
// For one thread at a time.
#pragma once

#include <chrono>
#include <string>
#include <utility>

#include "server/net/connection/newcomers.h"
#include "server/net/connection/visit_pace.h"
#include "server/net/places.h"

namespace atlas {

class Visit {
 public:
  using Clock = std::chrono::steady_clock;

  static constexpr Clock::duration kShort = std::chrono::seconds(1);

  // Both outlive this. It has entered among the newcomers.
  Visit(VisitPace& pace,
        Newcomers& newcomers,
        std::string address,
        Places::Place place,
        Clock::time_point now)
      : pace_(pace),
        newcomers_(newcomers),
        address_(std::move(address)),
        place_(std::move(place)),
        short_until_(now + kShort) {}
  Visit(const Visit&) = delete;
  Visit& operator=(const Visit&) = delete;
  ~Visit() {
    const auto now = Clock::now();
    if (!is_let_in_ || now < short_until_) {  // who says nothing may cost as much in two seconds
      const VisitKind kind = has_sent_ ? VisitKind::kFull : VisitKind::kSilent;
      pace_.Note(kind);
      if (!is_named_) {
        newcomers_.Charge(address_, pace_.CostOf(kind), now);
      }
    }
    if (!is_let_in_) {
      newcomers_.Leave(address_);
    }
  }

  // Takes this one, too.
  void Hold(Places::Place place) { place_ = Places::Both(std::move(place_), std::move(place)); }
  // Its peer has sent something.
  void NoteSent() { has_sent_ = true; }
  // Its peer has said who it is. With a name, which has limits of its own, it costs its address
  // nothing: others of that one may be anybody.
  void LetIn(bool is_named) {
    is_named_ = is_named;
    if (!is_let_in_) {
      is_let_in_ = true;
      newcomers_.Leave(address_);
    }
  }

 private:
  VisitPace& pace_;
  Newcomers& newcomers_;
  const std::string address_;
  Places::Place place_;
  const Clock::time_point short_until_;
  bool has_sent_ = false;
  bool is_let_in_ = false;
  bool is_named_ = false;
};

}  // namespace atlas
