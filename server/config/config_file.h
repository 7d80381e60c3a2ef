// The daemon's TOML file as flat settings: unknown keys and values of another type are refused.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "core/base/status.h"

namespace atlas {

// A value as text, and where it was given, for messages.
struct GivenSetting {
  std::string text;
  std::string origin;  // "atlasd.toml: line 3", "ATLASD_WORKERS", "--workers"
};

// By key: "listen", "data", "workers", "cache_mib", "survey_mib", "survey_disk_mib", "log_level",
// "map.cell_size", "map.segments", "map.segment_height", "map.preset". kInvalidArgument names file
// and line, kNotFound the file.
Result<std::map<std::string, GivenSetting>> ReadConfigFile(const std::filesystem::path& path);

}  // namespace atlas
