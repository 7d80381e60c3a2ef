#include "client/connection/area_message.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr double kMaxCoordinate_m = 1e7;  // as for poses
constexpr double kMaxLength_m = 1e8;
constexpr std::size_t kMaxTiles = 65'536;

Status Refuse(const std::string& why) {
  return {StatusCode::kInvalidArgument, StrCat("area: ", why)};
}

bool IsPlace(const Eigen::Vector2d& p_m) {
  return p_m.cwiseAbs().maxCoeff() <= kMaxCoordinate_m;
}

bool IsLength(double length_m) {
  return length_m >= 0.0 && length_m <= kMaxLength_m;
}

void SetPoint(const Eigen::Vector2d& p_m, wire::Area::Point& out) {
  out.set_x_um(std::llround(p_m.x() * 1e6));
  out.set_y_um(std::llround(p_m.y() * 1e6));
}

std::uint64_t Micrometres(double length_m) {
  return static_cast<std::uint64_t>(std::llround(length_m * 1e6));
}

Status SetArea(const DiscArea& disc, wire::Area& out) {
  if (!IsPlace(disc.center_m) || !IsLength(disc.radius_m)) {
    return Refuse("expected a centre within +-10000 km and a radius of 0 to 100000 km");
  }
  SetPoint(disc.center_m, *out.mutable_disc()->mutable_center());
  out.mutable_disc()->set_radius_um(Micrometres(disc.radius_m));
  return {};
}

Status SetArea(const BoxArea& box, wire::Area& out) {
  if (!IsPlace(box.min_m) || !IsPlace(box.max_m) ||
      !(box.min_m.array() <= box.max_m.array()).all()) {
    return Refuse("expected a box within +-10000 km, its first corner the lower one");
  }
  SetPoint(box.min_m, *out.mutable_box()->mutable_min());
  SetPoint(box.max_m, *out.mutable_box()->mutable_max());
  return {};
}

Status SetArea(const CorridorArea& corridor, wire::Area& out) {
  const auto& route = corridor.route_m;
  if (route.empty() || route.size() > CorridorArea::kMaxRoutePoints ||
      !std::all_of(route.begin(), route.end(), &IsPlace) || !IsLength(corridor.half_width_m)) {
    return Refuse(StrCat("a route of ", route.size(), " points, expected 1 to ",
                         CorridorArea::kMaxRoutePoints,
                         " within +-10000 km, and half a width of 0 to 100000 km"));
  }
  for (const Eigen::Vector2d& point_m : route) {
    SetPoint(point_m, *out.mutable_corridor()->add_route());
  }
  out.mutable_corridor()->set_half_width_um(Micrometres(corridor.half_width_m));
  return {};
}

Status SetArea(const TilesArea& tiles, wire::Area& out) {
  if (tiles.ids.size() > kMaxTiles) {
    return Refuse(StrCat(tiles.ids.size(), " tiles, expected at most ", kMaxTiles));
  }
  auto& keys = *out.mutable_tiles()->mutable_keys();
  for (const TileId& id : tiles.ids) {
    keys.Add(id.Key());
  }
  std::sort(keys.begin(), keys.end());
  const bool is_twice = std::adjacent_find(keys.begin(), keys.end()) != keys.end();
  return is_twice ? Refuse("a tile is named twice") : Status();
}

}  // namespace

Status AreaToWire(const MapArea& area, wire::Area& out) {
  return std::visit([&](const auto& one) { return SetArea(one, out); }, area);
}

}  // namespace atlas
