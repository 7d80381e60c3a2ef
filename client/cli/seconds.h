// --timeout: seconds on the command line, milliseconds in the protocol.
#pragma once

#include <chrono>

#include "core/base/status.h"

namespace atlas {

// kInvalidArgument outside of 0 to 1,000,000 s.
Result<std::chrono::milliseconds> TimeoutFromSeconds(double seconds);

}  // namespace atlas
