// Who is connected and has not said yet who he is, by address: one that opens connections and says
// nothing must take neither the others' places nor their turn. Pure: the time is passed in.
// Thread-safe.
#pragma once

#include <algorithm>
#include <cstddef>
#include <list>
#include <map>
#include <mutex>
#include <string>

#include "server/net/connection/token_bucket.h"

namespace atlas {

class Newcomers {
 public:
  using Time = TokenBucket::Time;

  struct Options {
    std::size_t max_open = 2048;  // of all addresses
    double cost_per_s = 50;       // of an address; 0: no limit
    // Addresses with nobody here that are remembered until their cost is paid, or until there are
    // more: who comes from so many is as well served by coming from new ones.
    std::size_t max_resting = 8192;
  };

  explicit Newcomers(const Options& options) : options_(options) {}

  // Takes a place. False: there is none for this address. It has at most an eighth of what is left,
  // so that N that take all they can have 1 / (8 + N) each, and one that is new finds as much.
  // An empty address counts among all and has no limit of its own, nor a cost.
  bool Enter(const std::string& address, Time now) {
    const std::lock_guard lock(mutex_);
    if (open_ >= options_.max_open) {
      return false;
    }
    if (!address.empty()) {
      Forget(now);
      const auto entry = Find(address);
      const std::size_t share = std::max<std::size_t>(1, (options_.max_open - open_) / kShare);
      if (entry->open >= share || entry->cost.Take(0.0, now) > TokenBucket::Duration::zero()) {
        return false;
      }
      if (entry->open == 0) {
        here_.splice(here_.end(), resting_, entry);
      }
      entry->open += 1;
    }
    open_ += 1;
    return true;
  }
  // One that entered has said who he is, or is gone.
  void Leave(const std::string& address) {
    const std::lock_guard lock(mutex_);
    open_ -= 1;
    if (!address.empty()) {
      const auto entry = Find(address);
      entry->open -= 1;
      if (entry->open == 0) {
        resting_.splice(resting_.end(), here_, entry);
      }
    }
  }
  // A visit of this address did cost so much; what it cannot pay at once it owes, and nobody of it
  // enters until that is paid.
  void Charge(const std::string& address, double cost, Time now) {
    if (address.empty() || options_.cost_per_s <= 0.0) {
      return;
    }
    const std::lock_guard lock(mutex_);
    Forget(now);
    Find(address)->cost.Take(cost, now);
  }

  std::size_t open() const {
    const std::lock_guard lock(mutex_);
    return open_;
  }
  // That are remembered.
  std::size_t addresses() const {
    const std::lock_guard lock(mutex_);
    return entries_.size();
  }

 private:
  struct Entry {
    std::string address;
    std::size_t open;
    TokenBucket cost;
  };
  using Entries = std::list<Entry>;

  static constexpr std::size_t kShare = 8;
  static constexpr int kForgottenAtOnce = 2;  // more than come at once

  Entries::iterator Find(const std::string& address) {
    const auto [found, is_new] = entries_.try_emplace(address);
    if (is_new) {
      found->second =
          resting_.insert(resting_.end(), Entry{address, 0, TokenBucket(options_.cost_per_s)});
    }
    return found->second;
  }
  // The first of those that rest, some at a time: nobody who comes waits for a look at all.
  void Forget(Time now) {
    for (int i = 0; i < kForgottenAtOnce && !resting_.empty(); ++i) {
      if (resting_.size() < options_.max_resting && !resting_.front().cost.IsFull(now)) {
        return;
      }
      entries_.erase(resting_.front().address);
      resting_.pop_front();
    }
  }

  const Options options_;
  mutable std::mutex mutex_;
  std::size_t open_ = 0;
  std::map<std::string, Entries::iterator> entries_;
  Entries here_;     // with somebody who entered
  Entries resting_;  // those who left last at the end
};

}  // namespace atlas
