// What each peer may do at a time by its name, or by its address without one, on all its
// connections together: one vehicle that runs wild must not take the others' share. Thread-safe.
#pragma once

#include <algorithm>
#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "server/net/byte_budget.h"
#include "server/net/connection/token_bucket.h"
#include "server/net/net_options.h"
#include "server/net/peer_share.h"
#include "server/net/places.h"

namespace atlas {

// Of one of them.
class IdentityAllowance {
 public:
  // `whose`: for messages.
  IdentityAllowance(const std::string& whose, const NameLimits& limits)
      : share_(std::make_shared<PeerShare>(whose, limits)),
        connections_(limits.connections),
        requests_(limits.requests_per_s),
        bytes_(limits.bytes_per_s),
        held_(limits.held_bytes) {}

  const std::string& whose() const { return share_->whose; }
  const std::shared_ptr<PeerShare>& share() const { return share_; }
  // Null: it has as many as it may.
  Places::Place TakeConnection() { return connections_.Take(); }
  std::size_t max_connections() const { return connections_.max_places(); }
  // Of requests that are under way.
  ByteBudget& held() { return held_; }
  // It sent so much; how long nothing more is read from it.
  TokenBucket::Duration Charge(std::size_t requests, std::size_t bytes, TokenBucket::Time now) {
    const std::lock_guard lock(mutex_);
    return std::max(requests_.Take(static_cast<double>(requests), now),
                    bytes_.Take(static_cast<double>(bytes), now));
  }
  // Nothing of that counts any more.
  bool IsRested(TokenBucket::Time now) {
    const std::lock_guard lock(mutex_);
    return requests_.IsFull(now) && bytes_.IsFull(now) && share_->served.IsRested(now);
  }
  // From now on; what it has already it keeps, and of its share all but the rate.
  void Change(const NameLimits& limits) {
    connections_.set_max_places(limits.connections);
    held_.set_max_bytes(limits.held_bytes);
    share_->served.set_rate(limits.served_bytes_per_s);
    const std::lock_guard lock(mutex_);
    requests_.set_rate(limits.requests_per_s);
    bytes_.set_rate(limits.bytes_per_s);
  }

 private:
  const std::shared_ptr<PeerShare> share_;
  Places connections_;
  std::mutex mutex_;
  TokenBucket requests_;
  TokenBucket bytes_;
  ByteBudget held_;
};

class IdentityLimits {
 public:
  explicit IdentityLimits(const NameLimits& limits) : limits_(limits) {}

  // Shared by all who hold it; forgotten when nobody does and it is as a new one: who comes again
  // goes on from where it was.
  std::shared_ptr<IdentityAllowance> OfName(const std::string& name, TokenBucket::Time now) {
    return Of({false, name}, name, now);
  }
  std::shared_ptr<IdentityAllowance> OfAddress(const std::string& address, TokenBucket::Time now) {
    return Of({true, address}, address + " without a name", now);
  }
  // For those who are there, too.
  void Change(const NameLimits& limits) {
    const std::lock_guard lock(mutex_);
    limits_ = limits;
    for (const auto& [key, allowance] : allowances_) {
      allowance->Change(limits);
    }
  }

 private:
  using Key = std::pair<bool, std::string>;  // whether it is an address

  std::shared_ptr<IdentityAllowance> Of(const Key& key,
                                        const std::string& whose,
                                        TokenBucket::Time now) {
    const std::lock_guard lock(mutex_);
    std::erase_if(allowances_, [now](const auto& entry) {
      return entry.second.use_count() == 1 && entry.second->IsRested(now);
    });
    auto& allowance = allowances_[key];
    if (allowance == nullptr) {
      allowance = std::make_shared<IdentityAllowance>(whose, limits_);
    }
    return allowance;
  }

  std::mutex mutex_;
  NameLimits limits_;
  std::map<Key, std::shared_ptr<IdentityAllowance>> allowances_;
};

}  // namespace atlas
