#include "server/net/access/access_control.h"

#include <utility>

#include "core/base/str_cat.h"
#include "core/geometry/keyframe_key.h"

namespace atlas {

Credentials Credentials::Of(std::optional<PeerCertificate> certificate, std::string_view token) {
  return {std::move(certificate), token.empty() ? std::nullopt : std::optional(HashOfToken(token))};
}

Result<Identity> AccessControl::Identify(const Credentials& credentials,
                                         std::int64_t now_ms) const {
  if (credentials.token) {
    const Result<TokenOwner> owner = tokens_.Find(*credentials.token, now_ms);
    if (!owner) {
      return Error(owner.error());
    }
    return Identity{owner->name, owner->role};
  }
  if (credentials.certificate) {
    const std::string& name = credentials.certificate->common_name;
    const std::string& unit = credentials.certificate->organizational_unit;
    const std::optional<Role> role = unit.empty() ? Role::kVehicle : RoleByName(unit);
    if (!role || *role == Role::kNone || !ValidateName("the common name", name).ok()) {
      return Error(StatusCode::kPermissionDenied,
                   StrCat("the certificate names '", NameFrom(name), "', organizational unit '",
                          NameFrom(unit), "': expected a name, and a role or nothing"));
    }
    return Identity{name, *role};
  }
  if (anonymous_ == Role::kNone) {
    return Error(StatusCode::kPermissionDenied, "the daemon expects a certificate or a token");
  }
  return Identity{"", anonymous_};
}

}  // namespace atlas
