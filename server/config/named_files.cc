#include "server/config/named_files.h"

#include <array>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <optional>
#include <system_error>

#include "core/base/hash.h"
#include "server/config/setting_table.h"

namespace atlas {
namespace {

std::optional<std::uint64_t> HashOf(const std::filesystem::path& file) {
  std::error_code ignored;  // what cannot be looked at cannot be read either
  if (!std::filesystem::is_regular_file(file, ignored)) {
    return std::nullopt;
  }
  std::ifstream in(file, std::ios::binary);
  Hash64Stream hash;
  std::array<char, 4096> part{};
  while (in.read(part.data(), part.size()) || in.gcount() > 0) {
    hash.Add({reinterpret_cast<const std::uint8_t*>(part.data()),
              static_cast<std::size_t>(in.gcount())});
  }
  return in.eof() ? std::optional(hash.value()) : std::nullopt;
}

}  // namespace

std::map<std::string, std::uint64_t> HashNamedFiles(const DaemonConfig& config) {
  std::map<std::string, std::uint64_t> hashes;
  for (const Setting& setting : AllSettings()) {
    if (setting.file == nullptr || (config.*setting.file).empty()) {
      continue;
    }
    if (const auto hash = HashOf(config.*setting.file)) {
      hashes[setting.key] = *hash;
    }
  }
  return hashes;
}

}  // namespace atlas
