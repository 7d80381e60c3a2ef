// What a peer may ask for, by its role and its name.
#pragma once

#include "core/base/status.h"
#include "proto/wire/envelope.h"
#include "server/net/access/access_control.h"

namespace atlas {

// kPermissionDenied: it may not ask for that.
Status CheckMayAsk(const Identity& identity, const wire::Envelope& request);

}  // namespace atlas
