#include "server/net/connection/peer_access.h"

#include <algorithm>
#include <utility>

#include "core/base/str_cat.h"

namespace atlas {

namespace ip = boost::asio::ip;

std::string SharedAddress(const ip::address& address) {
  if (address.is_v4()) {
    return address.to_string();
  }
  const ip::address_v6 six = address.to_v6();
  if (six.is_v4_mapped()) {
    return ip::make_address_v4(ip::v4_mapped, six).to_string();
  }
  ip::address_v6::bytes_type bytes = six.to_bytes();
  std::fill(bytes.begin() + 8, bytes.end(), 0);
  return StrCat(ip::address_v6(bytes).to_string(), "/64");
}

bool IsOfThisMachine(const ip::address& address) {
  const bool is_mapped = address.is_v6() && address.to_v6().is_v4_mapped();
  return is_mapped ? ip::make_address_v4(ip::v4_mapped, address.to_v6()).is_loopback()
                   : address.is_loopback();
}

Status PeerAccess::Identify(std::string_view token, std::int64_t now_ms) {
  credentials_ = Credentials::Of(stream_.certificate(), token);
  return IdentifyAgain(now_ms);
}

Status PeerAccess::IdentifyAgain(std::int64_t now_ms) {
  again_at_ = Clock::now() + options_.identity_check;
  if (security_.tls != nullptr) {  // the handshake may have been under other rules
    ATLAS_RETURN_IF_ERROR(stream_.CheckCertificate(*security_.tls));
  }
  Result<Identity> identity = security_.access->Identify(credentials_, now_ms);
  if (!identity) {
    return identity.error();
  }
  if (allowance_ != nullptr && identity->name != identity_.name) {
    return {StatusCode::kPermissionDenied, StrCat("it is called ", identity->name, " now")};
  }
  identity_ = *std::move(identity);
  return {};
}

Status PeerAccess::TakePlace() {
  const auto now = Clock::now();
  std::shared_ptr<IdentityAllowance> allowance;
  if (!identity_.name.empty()) {
    allowance = limits_.OfName(identity_.name, now);
  } else if (const auto address = stream_.PeerAddress();
             options_.is_loopback_limited || !IsOfThisMachine(address)) {
    allowance = limits_.OfAddress(SharedAddress(address), now);
  } else {
    visit_->LetIn(false);
    return {};
  }
  place_ = allowance->TakeConnection();
  if (place_ == nullptr) {
    return {StatusCode::kUnavailable,
            StrCat(allowance->max_connections(), " connections of ", allowance->whose(),
                   " are open already; try again later")};
  }
  allowance_ = std::move(allowance);
  visit_->LetIn(!identity_.name.empty());
  return {};
}

void PeerAccess::GiveBackPlaces() {
  if (visit_ != nullptr && stream_.has_received()) {
    visit_->NoteSent();
  }
  visit_.reset();
  place_.reset();
}

}  // namespace atlas
