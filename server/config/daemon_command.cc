#include "server/config/daemon_command.h"

#include <algorithm>
#include <map>
#include <string_view>
#include <utility>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <unistd.h>

#include "core/base/str_cat.h"
#include "server/config/config_file.h"
#include "server/config/setting_table.h"

namespace atlas {
namespace {

constexpr std::string_view kPrefix = "ATLASD_";

// Every variable that begins as those of the settings do has to be one of them.
Status AddEnvironment(const char* const* variables, GivenSettings& settings) {
  for (; variables != nullptr && *variables != nullptr; ++variables) {
    const std::string_view variable = *variables;
    if (!variable.starts_with(kPrefix)) {
      continue;
    }
    const std::string_view name = variable.substr(0, variable.find('='));
    const auto all = AllSettings();
    const auto setting = std::find_if(
        all.begin(), all.end(), [name](const Setting& known) { return name == known.environment; });
    if (setting == all.end()) {
      return {StatusCode::kInvalidArgument, StrCat("environment: unknown variable '", name, "'")};
    }
    settings[setting->key] = {
        std::string(variable.substr(std::min(name.size() + 1, variable.size()))),
        setting->environment};
  }
  return {};
}

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
  if (Status status = AddEnvironment(environ, settings); !status.ok()) {
    return Error(std::move(status));
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
