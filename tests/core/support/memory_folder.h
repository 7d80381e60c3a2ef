// A folder of a test's own, in memory where there is room: what is tested is not the disk.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>

namespace atlas::testing {

// Who asks removes it. Throws if it cannot be made.
inline std::filesystem::path NewMemoryFolder(const std::string& prefix) {
  constexpr std::uintmax_t kEnough = std::uintmax_t{1} << 30;
  const std::filesystem::path memory = "/dev/shm";
  std::error_code error;
  const auto room = std::filesystem::space(memory, error);
  const bool has_room = !error && room.available >= kEnough;
  const auto parent = has_room ? memory : std::filesystem::temp_directory_path();
  std::string name = (parent / (prefix + "_XXXXXX")).string();
  if (mkdtemp(name.data()) == nullptr) {
    throw std::runtime_error("cannot make " + name);
  }
  return name;
}

}  // namespace atlas::testing
