// A route as other programs read it: GeoJSON (RFC 7946) or CSV.
#pragma once

#include <string>

#include "core/base/status.h"
#include "core/planning/plan_route.h"

namespace atlas {

enum class RouteFormat { kGeoJson, kCsv };

// By the file's ending, ".geojson", ".json" or ".csv"; kInvalidArgument for another.
Result<RouteFormat> RouteFormatOf(const std::string& file);

// kGeoJson: one Feature, a LineString of x, y, z in metres of the map's frame, not longitude and
// latitude, with the route's figures and each point's clearance and slope as its properties;
// without a geometry when no route was found. kCsv: a line a waypoint,
// x_m,y_m,z_m,along_m,clearance_m,slope_deg.
std::string RouteText(const Route& route, RouteFormat format);

}  // namespace atlas
