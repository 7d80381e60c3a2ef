// Who a connection's peer is, by what it showed and by the rules as they are now, and what one may
// have by its name, or by its address without one. For the thread of the connection.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include <boost/asio/ip/address.hpp>

#include "core/base/status.h"
#include "server/net/access/access_control.h"
#include "server/net/connection/identity_limits.h"
#include "server/net/connection/shared_limits.h"
#include "server/net/connection/visit.h"
#include "server/net/net_options.h"
#include "server/net/places.h"
#include "server/net/server_security.h"
#include "server/net/stream/peer_stream.h"

namespace atlas {

// Whom peers of this address count as: it, or of IPv6 its network of 64 bits, which one house has
// to itself.
std::string SharedAddress(const boost::asio::ip::address& address);

// Of loopback.
bool IsOfThisMachine(const boost::asio::ip::address& address);

class PeerAccess {
 public:
  using Clock = std::chrono::steady_clock;

  // All outlive this.
  PeerAccess(const PeerStream& stream,
             SharedLimits& limits,
             const NetOptions& options,
             ServerSecurity security,
             std::shared_ptr<Visit> visit)
      : stream_(stream),
        limits_(limits.identities),
        options_(options),
        security_(std::move(security)),
        visit_(std::move(visit)) {}
  PeerAccess(const PeerAccess&) = delete;
  PeerAccess& operator=(const PeerAccess&) = delete;
  ~PeerAccess() { GiveBackPlaces(); }

  void set_security(ServerSecurity security) { security_ = std::move(security); }

  // It shows this token, and its certificate. kPermissionDenied.
  Status Identify(std::string_view token, std::int64_t now_ms);
  // Whether it would still come in.
  Status IdentifyAgain(std::int64_t now_ms);
  // To be called again.
  bool IsDue(Clock::time_point now) const { return now >= again_at_; }
  // One of the connections that it may have, and it is no newcomer any more: kUnavailable.
  Status TakePlace();
  // This, and what its visit has.
  void GiveBackPlaces();

  const Identity& identity() const { return identity_; }
  // Null: it may have what there is.
  const std::shared_ptr<IdentityAllowance>& allowance() const { return allowance_; }

 private:
  const PeerStream& stream_;
  IdentityLimits& limits_;
  const NetOptions& options_;
  ServerSecurity security_;
  Credentials credentials_;  // that it showed
  Identity identity_;
  Clock::time_point again_at_ = Clock::time_point::max();
  std::shared_ptr<IdentityAllowance> allowance_;
  std::shared_ptr<Visit> visit_;
  Places::Place place_;  // by name or address
};

}  // namespace atlas
