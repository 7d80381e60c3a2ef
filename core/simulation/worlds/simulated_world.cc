// Worlds by name.
#include "core/simulation/worlds/simulated_world.h"

#include "core/base/str_cat.h"

namespace atlas {

Result<WorldKind> WorldKindByName(std::string_view name) {
  if (name == "street") {
    return WorldKind::kStreet;
  }
  if (name == "overpass") {
    return WorldKind::kOverpass;
  }
  if (name == "garage") {
    return WorldKind::kGarage;
  }
  return Error(StatusCode::kInvalidArgument,
               StrCat("world '", name, "': expected street, overpass or garage"));
}

Result<SimulatedWorld> MakeWorld(WorldKind kind) {
  switch (kind) {
    case WorldKind::kStreet:
      return MakeStreetWorld();
    case WorldKind::kOverpass:
      return MakeOverpassWorld();
    case WorldKind::kGarage:
      return MakeGarageWorld({});
  }
  return Error(StatusCode::kInvalidArgument, StrCat("no world ", static_cast<int>(kind)));
}

}  // namespace atlas
