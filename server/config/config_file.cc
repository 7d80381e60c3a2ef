#include "server/config/config_file.h"

#include <algorithm>
#include <array>
#include <string_view>

#include <toml++/toml.h>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr std::array<std::string_view, 9> kKeys = {
    "listen",    "data",          "workers",      "cache_mib",
    "log_level", "map.cell_size", "map.segments", "map.segment_height",
    "map.preset"};

using Settings = std::map<std::string, std::string>;

Status BadLine(const std::filesystem::path& path,
               const toml::source_region& where,
               const std::string& what) {
  return Status(StatusCode::kInvalidArgument,
                StrCat(path.string(), ": line ", where.begin.line, ": ", what));
}

Result<std::string> TextOf(const toml::node& node) {
  if (const auto* text = node.as_string()) {
    return text->get();
  }
  if (const auto* number = node.as_integer()) {
    return StrCat(number->get());
  }
  if (const auto* number = node.as_floating_point()) {
    return StrCat(number->get());
  }
  return Error(StatusCode::kInvalidArgument, "expected a text or a number");
}

Status Flatten(const std::filesystem::path& path,
               const toml::table& table,
               const std::string& prefix,
               Settings& settings) {
  for (const auto& [name, node] : table) {
    const std::string key = prefix + std::string(name.str());
    const auto* inner = node.as_table();
    if (inner != nullptr && key == "map") {
      ATLAS_RETURN_IF_ERROR(Flatten(path, *inner, key + ".", settings));
      continue;
    }
    if (std::find(kKeys.begin(), kKeys.end(), key) == kKeys.end()) {
      return BadLine(path, node.source(), StrCat("unknown key '", key, "'"));
    }
    const Result<std::string> text = TextOf(node);
    if (!text) {
      return BadLine(path, node.source(), StrCat("'", key, "': ", text.error().message()));
    }
    settings[key] = *text;
  }
  return {};
}

}  // namespace

Result<Settings> ReadConfigFile(const std::filesystem::path& path) {
  Settings settings;
  try {
    const toml::table table = toml::parse_file(path.string());
    if (Status status = Flatten(path, table, "", settings); !status.ok()) {
      return Error(std::move(status));
    }
  } catch (const toml::parse_error& error) {
    return Error(BadLine(path, error.source(), std::string(error.description())));
  }
  return settings;
}

}  // namespace atlas
