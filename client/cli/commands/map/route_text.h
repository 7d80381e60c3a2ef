// A route as other programs read it: GeoJSON (RFC 7946) or CSV.
#pragma once

#include <string>

#include <boost/json/object.hpp>

#include "client/cli/files/route_file.h"
#include "core/base/status.h"
#include "core/planning/plan_route.h"

namespace atlas {

enum class RouteFormat { kGeoJson, kCsv };

// By the file's ending, ".geojson", ".json" or ".csv"; kInvalidArgument for another.
Result<RouteFormat> RouteFormatOf(const std::string& file);

// kGeoJson: one Feature, a LineString of x, y, z in metres of the map's frame, not longitude and
// latitude, with the route's figures and each point's clearance and slope as its properties;
// without a geometry when no route was found; `atlas`, beside them, names the atlas that it was
// planned in. kCsv: a line a waypoint, x_m,y_m,z_m,along_m,clearance_m,slope_deg. Ends that were
// moved by more than half a cell (`cell_m`) are `start` and `goal` of the properties.
std::string RouteText(const Route& route,
                      RouteFormat format,
                      const RouteAtlas& atlas,
                      double cell_m);

// asked, at, aside_m, above_m, layer, layers.
boost::json::object RouteEndJson(const RouteEnd& end);
// How far, and onto which surface of how many: "moved 1.20 m aside and 1.80 m down, onto ...".
std::string MoveText(const RouteEnd& end);

}  // namespace atlas
