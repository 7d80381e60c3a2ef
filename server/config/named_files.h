// The files that settings name, to see whether what is in them changed.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "server/config/daemon_config.h"

namespace atlas {

// Hash64 of what is in each, by the key of its setting. One that is not given, or that cannot be
// read, is left out: whoever needs it says why.
std::map<std::string, std::uint64_t> HashNamedFiles(const DaemonConfig& config);

}  // namespace atlas
