// What a peer may do.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace atlas {

// All but kNone may read.
enum class Role : std::uint8_t {
  kNone,     // nothing: it is refused
  kReader,   // reads the map and the atlas's numbers
  kVehicle,  // uploads, under its own name, and corrects the poses of its own keyframes
  kMerge,    // reads all keyframes, corrects all poses, publishes staged sessions
  kAdmin,    // everything
};

std::string_view RoleName(Role role);
// nullopt: there is no such role. "none" is one.
std::optional<Role> RoleByName(std::string_view name);

}  // namespace atlas
