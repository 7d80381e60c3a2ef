// Where the vehicle itself is or just was, nothing else can be, and what it stands on can be driven
// on: the surest evidence there is, also against what stood or moved there.
#pragma once

#include <cmath>
#include <cstdint>

#include <Eigen/Core>

#include "core/geometry/grid_geometry.h"

namespace atlas {

// Where the vehicle stands, or stood while it drove here: its sensor in the frame of a scan's grid.
struct VehiclePlace {
  Eigen::Vector3f sensor_m = Eigen::Vector3f::Zero();
  Eigen::Vector2f ahead = Eigen::Vector2f::UnitX();   // unit length, where its x axis points
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();  // unit length, of the ground below its wheels

  // Height of that ground at (x, y), for a sensor that is `sensor_height_m` above it.
  float GroundAt(float x_m, float y_m, float sensor_height_m) const {
    const float tilt_m = normal.x() * (x_m - sensor_m.x()) + normal.y() * (y_m - sensor_m.y());
    return sensor_m.z() - sensor_height_m - tilt_m / normal.z();
  }
};

// A box around the sensor, upright, from the ground to `clearance_m` above the sensor.
// Default: a car with its mirrors, shorter than it is, for the sensor may stand at either end, and
// the room that it keeps above itself.
struct VehicleBody {
  float half_length_m = 1.5F;
  float half_width_m = 1.1F;
  float clearance_m = 0.3F;

  // Calls visit(ix, iy, x_m, y_m) for the cells of `grid` whose centre (x_m, y_m) is below it at
  // `place`.
  template <typename Visit>
  void ForEachCell(const GridGeometry& grid, const VehiclePlace& place, Visit&& visit) const {
    const auto cell_m = static_cast<float>(grid.cell_size_m());
    const float reach_m = std::hypot(half_length_m, half_width_m);
    const auto first = [&](float m) {
      return static_cast<std::int32_t>(std::floor((m - reach_m) / cell_m));
    };
    const auto last = [&](float m) {
      return static_cast<std::int32_t>(std::ceil((m + reach_m) / cell_m));
    };
    for (std::int32_t iy = first(place.sensor_m.y()); iy < last(place.sensor_m.y()); ++iy) {
      for (std::int32_t ix = first(place.sensor_m.x()); ix < last(place.sensor_m.x()); ++ix) {
        const float x_m = (static_cast<float>(ix) + 0.5F) * cell_m;
        const float y_m = (static_cast<float>(iy) + 0.5F) * cell_m;
        const Eigen::Vector2f away = Eigen::Vector2f(x_m, y_m) - place.sensor_m.head<2>();
        const float along_m = place.ahead.dot(away);
        const float aside_m = place.ahead.x() * away.y() - place.ahead.y() * away.x();
        if (std::abs(along_m) <= half_length_m && std::abs(aside_m) <= half_width_m &&
            grid.Contains(ix, iy)) {
          visit(ix, iy, x_m, y_m);
        }
      }
    }
  }
};

}  // namespace atlas
