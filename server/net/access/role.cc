#include "server/net/access/role.h"

#include <algorithm>
#include <array>
#include <utility>

namespace atlas {
namespace {

constexpr std::array<std::pair<Role, std::string_view>, 5> kNames = {{{Role::kNone, "none"},
                                                                      {Role::kReader, "reader"},
                                                                      {Role::kVehicle, "vehicle"},
                                                                      {Role::kMerge, "merge"},
                                                                      {Role::kAdmin, "admin"}}};

}  // namespace

std::string_view RoleName(Role role) {
  return kNames[static_cast<std::size_t>(role)].second;
}

std::optional<Role> RoleByName(std::string_view name) {
  const auto* const found = std::find_if(
      kNames.begin(), kNames.end(), [name](const auto& entry) { return entry.second == name; });
  return found == kNames.end() ? std::nullopt : std::optional(found->first);
}

}  // namespace atlas
