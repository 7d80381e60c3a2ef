// The area that a sync asks for, as SyncPeer takes it.
#pragma once

#include <optional>

#include "client/vehicle/area_touch.h"
#include "core/geometry/map_area.h"
#include "proto/wire/convert.h"

namespace atlas {

template <typename Integer>
double Meters(Integer length_um) {
  return 1e-6 * static_cast<double>(length_um);
}

template <typename Point>
Eigen::Vector2d PlaceOf(const Point& point) {
  return {Meters(point.x_um()), Meters(point.y_um())};
}

// A disc or a corridor; none: everywhere.
inline std::optional<MapArea> AreaOf(const wire::Area& area) {
  if (area.has_disc()) {
    return DiscArea{PlaceOf(area.disc().center()), Meters(area.disc().radius_um())};
  }
  if (!area.has_corridor()) return std::nullopt;
  CorridorArea corridor{{}, Meters(area.corridor().half_width_um())};
  for (const auto& point : area.corridor().route()) {
    corridor.route_m.push_back(PlaceOf(point));
  }
  return corridor;
}

}  // namespace atlas
