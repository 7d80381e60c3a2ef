#include "server/config/config_file.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <system_error>

#include <toml++/toml.h>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

struct Key {
  std::string_view name;
  bool is_number;  // else a text
};

constexpr std::array<Key, 11> kKeys = {{{"listen", false},
                                        {"data", false},
                                        {"workers", true},
                                        {"cache_mib", true},
                                        {"survey_mib", true},
                                        {"survey_disk_mib", true},
                                        {"log_level", false},
                                        {"map.cell_size", true},
                                        {"map.segments", true},
                                        {"map.segment_height", true},
                                        {"map.preset", false}}};

using Settings = std::map<std::string, GivenSetting>;

std::string Origin(const std::filesystem::path& path, const toml::source_region& where) {
  return StrCat(path.string(), ": line ", where.begin.line);
}

Result<std::string> TextOf(const toml::node& node, bool is_number) {
  if (const auto* text = node.as_string(); text != nullptr && !is_number) {
    return text->get();
  }
  if (const auto* number = node.as_integer(); number != nullptr && is_number) {
    return StrCat(number->get());
  }
  if (const auto* number = node.as_floating_point(); number != nullptr && is_number) {
    return StrCat(number->get());
  }
  return Error(StatusCode::kInvalidArgument, is_number ? "expected a number" : "expected a text");
}

Status Flatten(const std::filesystem::path& path,
               const toml::table& table,
               const std::string& prefix,
               Settings& settings) {
  for (const auto& [name, node] : table) {
    const std::string key = prefix + std::string(name.str());
    const std::string origin = Origin(path, node.source());
    const auto* inner = node.as_table();
    if (inner != nullptr && key == "map") {
      ATLAS_RETURN_IF_ERROR(Flatten(path, *inner, key + ".", settings));
      continue;
    }
    const auto* const known =
        std::find_if(kKeys.begin(), kKeys.end(), [&key](const Key& k) { return k.name == key; });
    if (known == kKeys.end()) {
      return Status(StatusCode::kInvalidArgument, StrCat(origin, ": unknown key '", key, "'"));
    }
    const Result<std::string> text = TextOf(node, known->is_number);
    if (!text) {
      return text.error().WithContext(StrCat(origin, ": '", key, "'"));
    }
    settings[key] = {*text, origin};
  }
  return {};
}

}  // namespace

Result<Settings> ReadConfigFile(const std::filesystem::path& path) {
  std::error_code ignored;  // what cannot be looked at cannot be read either
  if (!std::filesystem::exists(path, ignored)) {
    return Error(StatusCode::kNotFound, StrCat("there is no file ", path.string()));
  }
  if (std::filesystem::is_directory(path, ignored)) {  // which toml++ takes for an empty file
    return Error(StatusCode::kInvalidArgument,
                 StrCat(path.string(), " is a folder: expected a file"));
  }
  Settings settings;
  try {
    const toml::table table = toml::parse_file(path.string());
    if (Status status = Flatten(path, table, "", settings); !status.ok()) {
      return Error(std::move(status));
    }
  } catch (const toml::parse_error& error) {
    return Error(StatusCode::kInvalidArgument,
                 StrCat(Origin(path, error.source()), ": ", error.description()));
  }
  return settings;
}

}  // namespace atlas
