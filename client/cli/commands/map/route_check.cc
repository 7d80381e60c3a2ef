#include "client/cli/commands/map/route_check.h"

#include "client/cli/output/text_table.h"
#include "core/base/str_cat.h"

namespace atlas {

RouteCheck CheckOf(const std::string& file,
                   const std::optional<RouteAtlas>& planned_in,
                   const RouteAtlas& drawn_in,
                   const RouteGround& ground) {
  RouteCheck check{file, std::nullopt, ground.points(), ground.on_tiles(), ground.on_surfaces()};
  if (planned_in) check.is_of_atlas = *planned_in == drawn_in;
  return check;
}

Status NoteRoute(const RouteCheck& check, std::ostream& err) {
  const bool is_of_another = !check.is_of_atlas.value_or(true);
  if (check.on_tiles == 0) {
    return {StatusCode::kConflict,
            StrCat(check.file, ": none of its ", check.points,
                   " points lies on a tile of this map: it was planned ",
                   is_of_another ? "in another atlas" : "in another one, or in another frame")};
  }
  if (is_of_another) {
    err << "note: " << check.file
        << " was planned in another atlas: where it leads here nobody checked\n";
  }
  if (check.on_tiles < check.points) {
    err << "note: " << check.points - check.on_tiles << " of " << check.points << " points of "
        << check.file << " lie on no tile of this map\n";
  }
  if (check.on_surfaces < check.on_tiles) {
    err << "note: " << check.on_tiles - check.on_surfaces << " of " << check.points << " points of "
        << check.file << " have no surface within " << FixedText(RouteGround::kNear_m, 1)
        << " m above or below them: planned in another map, or in this one before it changed\n";
  }
  return {};
}

boost::json::object RouteCheckJson(const RouteCheck& check) {
  return {{"points", check.points},
          {"on_tiles", check.on_tiles},
          {"on_surfaces", check.on_surfaces},
          {"same_atlas", check.is_of_atlas ? boost::json::value(*check.is_of_atlas) : nullptr}};
}

}  // namespace atlas
