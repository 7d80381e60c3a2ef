// How the server talks to its peers, and whom it lets in. Immutable: a reload makes another one.
#pragma once

#include <memory>

#include "server/net/access/access_control.h"
#include "server/net/stream/tls_context.h"

namespace atlas {

struct ServerSecurity {
  std::shared_ptr<const TlsContext> tls;  // null: in the clear
  std::shared_ptr<const AccessControl> access = std::make_shared<const AccessControl>();
};

}  // namespace atlas
