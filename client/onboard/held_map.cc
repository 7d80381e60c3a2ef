#include "client/onboard/held_map.h"

#include <algorithm>
#include <iterator>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "core/localization/places/place_index.h"

namespace atlas {
namespace {

std::vector<std::shared_ptr<const Tile>> FinestOf(const MapAround& map) {
  std::vector<std::shared_ptr<const Tile>> finest;
  std::copy_if(map.tiles.begin(), map.tiles.end(), std::back_inserter(finest),
               [](const auto& tile) { return tile->id.level == 0; });
  return finest;
}

std::shared_ptr<const PlaceIndex> PlacesOf(const std::vector<std::shared_ptr<const Tile>>& tiles,
                                           const MapProfile& profile) {
  auto places = std::make_shared<PlaceIndex>(profile);
  for (const auto& tile : tiles) {
    places->Add(*tile);
  }
  places->Finish();
  return places;
}

// As it was made last.
struct Made {
  std::shared_ptr<const Relocalizer> relocalizer;
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  std::vector<std::weak_ptr<const Tile>> tiles;  // a changed one is another

  bool IsFor(const Eigen::Vector2d& place, double radius_m) const {
    return relocalizer != nullptr && (place - center).norm() < 0.5 * radius_m;
  }
  bool IsOf(const std::vector<std::shared_ptr<const Tile>>& finest) const {
    return std::equal(tiles.begin(), tiles.end(), finest.begin(), finest.end(),
                      [](const auto& made, const auto& tile) { return made.lock() == tile; });
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
    const std::vector<std::shared_ptr<const Tile>> finest = FinestOf(*map);
    if (!is_made || !made.IsOf(finest)) {
      made = {nullptr, center, {finest.begin(), finest.end()}};
      if (!finest.empty()) {
        made.relocalizer = std::make_shared<const Relocalizer>(profile, PlacesOf(finest, profile),
                                                               TilesOf(view, options), relocalizer);
      }
    }
    return made.relocalizer;
  };
}

}  // namespace atlas
