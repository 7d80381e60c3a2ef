// What the parts of the daemon are told of its configuration.
#pragma once

#include <functional>
#include <memory>

#include "core/base/status.h"
#include "server/config/daemon_config.h"
#include "server/net/net_options.h"
#include "server/net/server_security.h"
#include "server/service/atlas_service.h"
#include "server/store/atlas_store.h"

namespace atlas {

// The atlas in the configured directory, made if there is none. kInvalidData: its map is another
// than the one that was asked for; and the errors of OpenSqliteStore. `on_failed_sync` as there.
Result<std::unique_ptr<AtlasStore>> OpenStore(const DaemonConfig& config,
                                              std::function<void(const Status&)> on_failed_sync);

ServiceOptions ServiceFrom(const DaemonConfig& config);
NameLimits NameLimitsFrom(const DaemonConfig& config);
NetOptions NetFrom(const DaemonConfig& config);

// Reads certificates and tokens. kInvalidArgument: a role that there is not; and the errors of
// TokenList::Read and TlsContext::Load.
Result<ServerSecurity> SecurityFrom(const DaemonConfig& config);

}  // namespace atlas
