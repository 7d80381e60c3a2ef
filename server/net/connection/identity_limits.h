// What each peer with a name may do at a time, on all its connections together: one vehicle that
// runs wild must not take the others' share. Thread-safe.
#pragma once

#include <algorithm>
#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "server/net/connection/byte_budget.h"
#include "server/net/connection/token_bucket.h"
#include "server/net/net_options.h"
#include "server/net/places.h"

namespace atlas {

// Of one name.
class IdentityAllowance {
 public:
  explicit IdentityAllowance(const NetOptions& options)
      : connections_(options.identity_connections),
        requests_(options.identity_requests_per_s),
        bytes_(options.identity_bytes_per_s),
        held_(options.identity_held_bytes) {}

  // Null: it has as many as it may.
  Places::Place TakeConnection() { return connections_.Take(); }
  // Of requests that are under way.
  ByteBudget& held() { return held_; }
  // It sent so much; how long nothing more is read from it.
  TokenBucket::Duration Charge(std::size_t requests, std::size_t bytes, TokenBucket::Time now) {
    const std::lock_guard lock(mutex_);
    return std::max(requests_.Take(static_cast<double>(requests), now),
                    bytes_.Take(static_cast<double>(bytes), now));
  }

 private:
  Places connections_;
  std::mutex mutex_;
  TokenBucket requests_;
  TokenBucket bytes_;
  ByteBudget held_;
};

class IdentityLimits {
 public:
  // `options` outlive this.
  explicit IdentityLimits(const NetOptions& options) : options_(options) {}

  // Shared by all who hold it; forgotten when nobody does.
  std::shared_ptr<IdentityAllowance> Of(const std::string& name) {
    const std::lock_guard lock(mutex_);
    std::erase_if(allowances_, [](const auto& entry) { return entry.second.expired(); });
    auto allowance = allowances_[name].lock();
    if (allowance == nullptr) {
      allowance = std::make_shared<IdentityAllowance>(options_);
      allowances_[name] = allowance;
    }
    return allowance;
  }

 private:
  const NetOptions& options_;
  std::mutex mutex_;
  std::map<std::string, std::weak_ptr<IdentityAllowance>> allowances_;
};

}  // namespace atlas
