// Who a peer is, and what it may ask for. Immutable and thread-safe: reloading makes another one.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "core/base/status.h"
#include "server/net/access/role.h"
#include "server/net/access/token_list.h"
#include "server/net/stream/tls_context.h"

namespace atlas {

// What a peer showed: kept, so that it can be looked at again when the rules change. Of a token
// only its hash.
struct Credentials {
  std::optional<PeerCertificate> certificate;
  std::optional<TokenHash> token;

  static Credentials Of(std::optional<PeerCertificate> certificate, std::string_view token);
};

struct Identity {
  std::string name;  // empty: nobody in particular
  Role role = Role::kNone;
};

class AccessControl {
 public:
  // Everybody may do what `anonymous` may, without a certificate or a token.
  explicit AccessControl(TokenList tokens = {}, Role anonymous = Role::kAdmin)
      : tokens_(std::move(tokens)), anonymous_(anonymous) {}

  // By its token, if it shows one, else by its certificate: the common name, and the role that its
  // organizational unit names (none: a vehicle). kPermissionDenied: a token or a certificate that
  // counts for nothing, or neither where one is expected.
  Result<Identity> Identify(const Credentials& credentials, std::int64_t now_ms) const;

 private:
  TokenList tokens_;
  Role anonymous_;
};

}  // namespace atlas
