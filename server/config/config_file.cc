#include "server/config/config_file.h"

#include <cstdint>
#include <system_error>
#include <utility>

#include <toml++/toml.h>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

// Ten times what a file with all settings and a line about each takes. toml++ puts tables into
// tables along a key with dots, however many, and takes them apart by recursion: 30,000 of them are
// more than a stack holds.
constexpr std::uintmax_t kMaxBytes = 16u << 10;

using Types = std::map<std::string, SettingType>;
using Settings = std::map<std::string, GivenSetting>;

std::string Origin(const std::filesystem::path& path, const toml::source_region& where) {
  return StrCat(path.string(), ": line ", where.begin.line);
}

Result<std::string> TextOf(const toml::node& node, SettingType type) {
  switch (type) {
    case SettingType::kText:
      if (const auto* text = node.as_string()) {
        return text->get();
      }
      return Error(StatusCode::kInvalidArgument, "expected a text");
    case SettingType::kTruth:
      if (const auto* truth = node.as_boolean()) {
        return std::string(truth->get() ? "true" : "false");
      }
      return Error(StatusCode::kInvalidArgument, "expected true or false");
    case SettingType::kNumber:
      break;
  }
  if (const auto* number = node.as_integer()) {
    return StrCat(number->get());
  }
  if (const auto* number = node.as_floating_point()) {
    return StrCat(number->get());
  }
  return Error(StatusCode::kInvalidArgument, "expected a number");
}

class FlatFile {
 public:
  FlatFile(const std::filesystem::path& path, const Types& types) : path_(path), types_(types) {}

  Status Add(const toml::table& table, const std::string& prefix = "") {
    for (const auto& [name, node] : table) {
      const std::string key = prefix + std::string(name.str());
      const std::string origin = Origin(path_, node.source());
      const toml::table* const inner = node.as_table();
      if (inner != nullptr && IsTable(key)) {
        ATLAS_RETURN_IF_ERROR(Add(*inner, key + "."));
        continue;
      }
      const auto type = types_.find(key);
      if (type == types_.end()) {
        return Status(StatusCode::kInvalidArgument, StrCat(origin, ": unknown key '", key, "'"));
      }
      const Result<std::string> text = TextOf(node, type->second);
      if (!text) {
        return text.error().WithContext(StrCat(origin, ": '", key, "'"));
      }
      settings_[key] = {*text, origin};
    }
    return {};
  }
  Settings Take() { return std::move(settings_); }

 private:
  bool IsTable(const std::string& key) const {
    const auto first = types_.lower_bound(key + ".");
    return first != types_.end() && first->first.starts_with(key + ".");
  }

  const std::filesystem::path& path_;
  const Types& types_;
  Settings settings_;
};

}  // namespace

Result<Settings> ReadConfigFile(const std::filesystem::path& path, const Types& types) {
  std::error_code ignored;  // what cannot be looked at cannot be read either
  if (!std::filesystem::exists(path, ignored)) {
    return Error(StatusCode::kNotFound, StrCat("there is no file ", path.string()));
  }
  if (std::filesystem::is_directory(path, ignored)) {  // which toml++ takes for an empty file
    return Error(StatusCode::kInvalidArgument,
                 StrCat(path.string(), " is a folder: expected a file"));
  }
  const std::uintmax_t size = std::filesystem::file_size(path, ignored);
  if (!ignored && size > kMaxBytes) {
    return Error(StatusCode::kInvalidArgument,
                 StrCat(path.string(), ": ", size, " bytes, expected at most ", kMaxBytes));
  }
  FlatFile file(path, types);
  try {
    const toml::table table = toml::parse_file(path.string());
    if (Status status = file.Add(table); !status.ok()) {
      return Error(std::move(status));
    }
  } catch (const toml::parse_error& error) {
    return Error(StatusCode::kInvalidArgument,
                 StrCat(Origin(path, error.source()), ": ", error.description()));
  }
  return file.Take();
}

}  // namespace atlas
