#include "server/config/daemon_command.h"

#include <cstdlib>
#include <map>
#include <utility>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include "core/base/str_cat.h"
#include "server/config/config_file.h"
#include "server/config/setting_table.h"

namespace atlas {
namespace {

// File, then environment, then flags: later ones win.
Result<GivenSettings> Collect(const GivenSettings& flags, const std::string& file) {
  std::map<std::string, SettingType> types;
  for (const Setting& setting : AllSettings()) {
    types[setting.key] = setting.type;
  }
  GivenSettings settings;
  if (!file.empty()) {
    Result<GivenSettings> read = ReadConfigFile(file, types);
    if (!read) {
      return read;
    }
    settings = std::move(*read);
  }
  for (const Setting& setting : AllSettings()) {
    if (const char* value = std::getenv(setting.environment); value != nullptr) {
      settings[setting.key] = {value, setting.environment};
    }
  }
  for (const auto& [key, given] : flags) {
    settings[key] = given;
  }
  return settings;
}

}  // namespace

Result<DaemonCommand> ParseDaemonCommand(int argc, const char* const* argv) {
  CLI::App app("atlasd: the Road Atlas map server", "atlasd");
  app.set_version_flag("--version", "atlasd " ATLAS_VERSION);
  GivenSettings flags;
  std::string file;
  app.add_option("--config", file, "TOML file with these settings")->type_name("FILE");
  const std::map<std::string, std::string> defaults = SettingDefaults();
  for (const Setting& setting : AllSettings()) {
    CLI::Option* option = app.add_option_function<std::string>(
        setting.flag,
        [&flags, &setting](const std::string& value) {
          flags[setting.key] = {value, setting.flag};
        },
        StrCat(setting.help, " [", defaults.at(setting.key), "]"));
    option->type_name(setting.value);
  }
  DaemonCommand command;
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    command.text = app.help();
    return command;
  } catch (const CLI::CallForVersion&) {
    command.text = app.version() + "\n";
    return command;
  } catch (const CLI::ParseError& error) {
    return Error(StatusCode::kInvalidArgument, error.what());
  }
  Result<GivenSettings> settings = Collect(flags, file);
  if (!settings) {
    return Error(settings.error());
  }
  Result<DaemonConfig> config = ConfigFrom(*settings);
  if (!config) {
    return Error(config.error());
  }
  command.config = *std::move(config);
  command.given = *std::move(settings);
  if (command.config.data.empty()) {
    return Error(StatusCode::kInvalidArgument, "--data DIR is required");
  }
  return command;
}

}  // namespace atlas
