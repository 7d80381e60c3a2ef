#include "client/onboard/held_map.h"

#include <cstdint>
#include <memory>
#include <numbers>
#include <utility>

#include "core/localization/places/place_index.h"

namespace atlas {
namespace {

std::shared_ptr<const PlaceIndex> PlacesOf(const MapAround& map, const MapProfile& profile) {
  auto places = std::make_shared<PlaceIndex>(profile);
  for (const auto& tile : map.tiles) {
    if (tile->id.level == 0) places->Add(*tile);
  }
  places->Finish();
  return places;
}

// As it was made last.
struct Made {
  std::shared_ptr<const Relocalizer> relocalizer;
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  std::uint64_t finest_places = 0;

  bool IsFor(const Eigen::Vector2d& place, double radius_m) const {
    return relocalizer != nullptr && (place - center).norm() < 0.5 * radius_m;
  }
};

}  // namespace

TilesAround TilesOf(AtlasView& view, const AroundOptions& options, OnMap on_map) {
  return [&view, options, on_map = std::move(on_map)](
             const Eigen::Vector3d& center,
             double radius_m) -> Result<std::vector<std::shared_ptr<const Tile>>> {
    auto map = view.Around(center.head<2>(), radius_m * std::numbers::sqrt2, options);
    if (!map) return Error(map.error());
    if (on_map) on_map(*map);
    return std::move(map->tiles);
  };
}

RelocalizerSource RelocalizerOf(AtlasView& view,
                                const MapProfile& profile,
                                std::function<Eigen::Vector2d()> last_place,
                                double radius_m,
                                const AroundOptions& options,
                                const RelocalizerOptions& relocalizer) {
  return [&view, profile, last_place = std::move(last_place), radius_m, options, relocalizer,
          made = Made()]() mutable -> Result<std::shared_ptr<const Relocalizer>> {
    const Eigen::Vector2d place = last_place();
    const bool is_made = made.IsFor(place, radius_m);
    const Eigen::Vector2d center = is_made ? made.center : place;
    const auto map = view.Around(center, radius_m, options);
    if (!map) return Error(map.error());
    if (!is_made || map->finest_places > made.finest_places) {
      made = {nullptr, center, map->finest_places};
      if (map->finest_places > 0) {
        made.relocalizer = std::make_shared<const Relocalizer>(profile, PlacesOf(*map, profile),
                                                               TilesOf(view, options), relocalizer);
      }
    }
    return made.relocalizer;
  };
}

}  // namespace atlas
