// Waypoints as text.
#include "client/cli/commands/map/route_text.h"

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "client/cli/output/json_text.h"
#include "client/cli/output/text_table.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

boost::json::array Numbers(const std::vector<double>& values) {
  boost::json::array numbers;
  for (const double value : values) numbers.push_back(Rounded(value, 3));
  return numbers;
}

std::string GeoJson(const Route& route) {
  boost::json::array line;
  for (const Eigen::Vector3d& p : route.waypoints) {
    line.push_back({Rounded(p.x(), 3), Rounded(p.y(), 3), Rounded(p.z(), 3)});
  }
  // A LineString has two positions at least.
  boost::json::value geometry = nullptr;
  if (line.size() == 1) {
    geometry = boost::json::object{{"type", "Point"}, {"coordinates", line.front()}};
  } else if (!line.empty()) {
    geometry = boost::json::object{{"type", "LineString"}, {"coordinates", std::move(line)}};
  }
  const boost::json::object feature{{"type", "Feature"},
                                    {"geometry", std::move(geometry)},
                                    {"properties",
                                     {{"frame", "map, metres"},
                                      {"found", route.found},
                                      {"length_m", Rounded(route.length_m, 3)},
                                      {"cost", Rounded(route.cost, 3)},
                                      {"clearance_m", Numbers(route.clearance_m)},
                                      {"slope_deg", Numbers(route.slope_deg)}}}};
  return JsonText(feature) + "\n";
}

std::string Csv(const Route& route) {
  std::string text = "x_m,y_m,z_m,along_m,clearance_m,slope_deg\n";
  double along_m = 0.0;
  for (std::size_t i = 0; i < route.waypoints.size(); ++i) {
    const Eigen::Vector3d& p = route.waypoints[i];
    if (i > 0) along_m += (p - route.waypoints[i - 1]).norm();
    for (const double value : {p.x(), p.y(), p.z(), along_m, route.clearance_m[i]}) {
      text += FixedText(value, 3) + ",";
    }
    text += FixedText(route.slope_deg[i], 3) + "\n";
  }
  return text;
}

}  // namespace

Result<RouteFormat> RouteFormatOf(const std::string& file) {
  if (file.ends_with(".geojson") || file.ends_with(".json")) return RouteFormat::kGeoJson;
  if (file.ends_with(".csv")) return RouteFormat::kCsv;
  return Error(StatusCode::kInvalidArgument,
               StrCat("route file '", file, "': expected a name in .geojson, .json or .csv"));
}

std::string RouteText(const Route& route, RouteFormat format) {
  return format == RouteFormat::kGeoJson ? GeoJson(route) : Csv(route);
}

}  // namespace atlas
