// The daemon's TOML file as flat settings, unknown keys refused.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "core/base/status.h"

namespace atlas {

// Keys "listen", "data", "workers", "cache_mib", "log_level", "map.cell_size", "map.segments",
// "map.segment_height", "map.preset" and their values as text. kInvalidArgument names file and
// line.
Result<std::map<std::string, std::string>> ReadConfigFile(const std::filesystem::path& path);

}  // namespace atlas
