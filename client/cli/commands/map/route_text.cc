// Waypoints as text.
#include "client/cli/commands/map/route_text.h"

#include <cmath>
#include <utility>

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

boost::json::array Position(const Eigen::Vector3d& p) {
  return {Rounded(p.x(), 3), Rounded(p.y(), 3), Rounded(p.z(), 3)};
}

boost::json::object Properties(const Route& route, double cell_m) {
  boost::json::object properties{{"frame", "map, metres"},
                                 {"found", route.found},
                                 {"length_m", Rounded(route.length_m, 3)},
                                 {"cost", Rounded(route.cost, 3)},
                                 {"clearance_m", Numbers(route.clearance_m)},
                                 {"slope_deg", Numbers(route.slope_deg)}};
  for (const auto& [name, end] : {std::pair("start", &route.start), {"goal", &route.goal}}) {
    if (*end && (*end)->IsMoved(cell_m)) properties[name] = RouteEndJson(**end);
  }
  return properties;
}

std::string GeoJson(const Route& route, const RouteAtlas& atlas, double cell_m) {
  boost::json::array line;
  for (const Eigen::Vector3d& p : route.waypoints) {
    line.push_back(Position(p));
  }
  // A LineString has two positions at least.
  boost::json::value geometry = nullptr;
  if (line.size() == 1) {
    geometry = boost::json::object{{"type", "Point"}, {"coordinates", line.front()}};
  } else if (!line.empty()) {
    geometry = boost::json::object{{"type", "LineString"}, {"coordinates", std::move(line)}};
  }
  const boost::json::object feature{{"type", "Feature"},
                                    {"atlas", RouteAtlasJson(atlas)},
                                    {"geometry", std::move(geometry)},
                                    {"properties", Properties(route, cell_m)}};
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

std::string RouteText(const Route& route,
                      RouteFormat format,
                      const RouteAtlas& atlas,
                      double cell_m) {
  return format == RouteFormat::kGeoJson ? GeoJson(route, atlas, cell_m) : Csv(route);
}

boost::json::object RouteEndJson(const RouteEnd& end) {
  return {{"asked", Position(end.asked)},
          {"at", Position(end.at)},
          {"aside_m", Rounded(end.aside_m(), 3)},
          {"above_m", Rounded(end.above_m(), 3)},
          {"layer", end.layer},
          {"layers", end.layers}};
}

std::string MoveText(const RouteEnd& end) {
  const std::string surface =
      end.layers == 1 ? std::string("the surface there")
                      : StrCat("layer ", end.layer, " of ", end.layers, " there, 0 is the lowest");
  return StrCat("moved ", FixedText(end.aside_m(), 2), " m aside and ",
                FixedText(std::abs(end.above_m()), 2), end.above_m() < 0.0 ? " m down" : " m up",
                ", onto ", surface, ", at ", FixedText(end.at.z(), 2), " m");
}

}  // namespace atlas
