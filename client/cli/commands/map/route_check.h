// Whether a route that is to be drawn is one of this map.
#pragma once

#include <optional>
#include <ostream>
#include <string>

#include <boost/json/object.hpp>

#include "client/cli/files/route_file.h"
#include "client/map/route_ground.h"
#include "core/base/status.h"

namespace atlas {

struct RouteCheck {
  std::string file;
  std::optional<bool> is_of_atlas;  // none: the file does not say which it is of
  std::size_t points = 0;
  std::size_t on_tiles = 0;     // of them
  std::size_t on_surfaces = 0;  // of those
};

RouteCheck CheckOf(const std::string& file,
                   const std::optional<RouteAtlas>& planned_in,
                   const RouteAtlas& drawn_in,
                   const RouteGround& ground);

// kConflict where no point lies on a tile. What else is odd is noted on `err`.
Status NoteRoute(const RouteCheck& check, std::ostream& err);
boost::json::object RouteCheckJson(const RouteCheck& check);

}  // namespace atlas
