// A vehicle that holds nothing asks where it is, and how to go on.
#include <cmath>
#include <iostream>

#include "client/onboard/held_map.h"
#include "client/onboard/held_tiles.h"
#include "core/localization/cloud_localizer.h"
#include "core/planning/plan_route.h"

int main() {
  const atlas::MapProfile profile;
  auto store = atlas::TileStore::Open({atlas::Bytes(16, 1), profile}, {});
  if (!store) {
    std::cerr << store.error().message() << '\n';
    return 1;
  }
  atlas::AtlasView view(*store, nullptr);
  atlas::SensorLayout layout;
  layout.elevation_rad.assign(16, 0.0F);
  for (int ring = 0; ring < 16; ++ring) {
    layout.elevation_rad[static_cast<std::size_t>(ring)] = 0.035F * static_cast<float>(ring - 8);
  }
  const auto here = [] {
    return Eigen::Vector2d(0.0, 0.0);
  };
  atlas::CloudLocalizer localizer(profile, layout, atlas::TilesOf(view, {}), {},
                                  atlas::RelocalizerOf(view, profile, here, 300.0, {}));
  localizer.Start(atlas::Pose::Identity());
  atlas::PointCloud cloud;
  for (int i = 0; i < 360; ++i) {
    const float azimuth_rad = static_cast<float>(i) * 0.01745F;
    cloud.points.emplace_back(10.0F * std::cos(azimuth_rad), 10.0F * std::sin(azimuth_rad), -1.8F);
  }
  const auto result = localizer.Localize(cloud, Eigen::Quaterniond::Identity());
  if (!result) {
    std::cerr << result.error().message() << '\n';
    return 1;
  }
  const bool is_lost =
      result->health == atlas::LocalizationHealth::kLost && result->cover == atlas::MapCover::kNone;
  atlas::HeldTiles tiles(*store);
  const auto route = atlas::PlanRoute(tiles, profile, {{0.0, 0.0, 1.8}, {50.0, 0.0, 1.8}, {}});
  const bool is_nowhere = !route && route.error().code() == atlas::StatusCode::kNotFound;
  std::cout << (is_lost ? "lost without a map, " : "found, ")
            << (is_nowhere ? "no route" : "a route") << '\n';
  return 0;
}
