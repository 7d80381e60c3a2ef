// All settings of the daemon: how each is called, what it takes and what it does to the
// configuration.
#pragma once

#include <filesystem>
#include <map>
#include <span>
#include <string>

#include "core/base/status.h"
#include "server/config/config_file.h"
#include "server/config/daemon_config.h"

namespace atlas {

struct Setting {              // NOLINT(clang-analyzer-optin.performance.Padding): in reading order
  const char* key = nullptr;  // in the file
  const char* flag = nullptr;
  const char* environment = nullptr;
  const char* value = nullptr;  // what kind of one, for --help
  const char* help = nullptr;
  SettingType type = {};
  // kInvalidArgument says what was expected.
  Status (*apply)(const std::string& key, const std::string& text, DaemonConfig& config) = nullptr;
  bool is_live = false;  // may change while the daemon runs: a part of LiveConfig takes it
  // It names a file, which is read again with the settings.
  std::filesystem::path DaemonConfig::*file = nullptr;
};

std::span<const Setting> AllSettings();
// Of a key that there is.
const Setting& SettingByKey(const std::string& key);
// What each setting is when it is not given, for --help.
std::map<std::string, std::string> SettingDefaults();

}  // namespace atlas
