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

enum class SettingType { kText, kNumber, kTruth };

// The settings of a file by key, of those that there are; one in a table is "table.key".
// kInvalidArgument names file and line, kNotFound the file.
Result<std::map<std::string, GivenSetting>> ReadConfigFile(
    const std::filesystem::path& path, const std::map<std::string, SettingType>& types);

}  // namespace atlas
