#include "client/merge/changes/find_changes.h"

#include <cmath>
#include <iterator>
#include <memory>
#include <utility>

namespace atlas {
namespace {

using Tiles = std::vector<std::shared_ptr<const Tile>>;

// The tile and those around it.
Result<Tiles> Around(FusedSide& side, const TileId& id) {
  Tiles tiles;
  for (std::int32_t x = -1; x <= 1; ++x) {
    for (std::int32_t y = -1; y <= 1; ++y) {
      auto tile = side.Fuse({0, id.x + x, id.y + y});
      if (!tile) return Error(tile.error());
      if (*tile != nullptr) tiles.push_back(*std::move(tile));
    }
  }
  return tiles;
}

double MiddleHeight(const Tile& tile) {
  double sum_mm = 0.0;
  for (const TileLayer& layer : tile.layers) sum_mm += layer.altitude_mm;
  return 1e-3 * sum_mm / static_cast<double>(tile.layers.size());
}

class Comparison {
 public:
  Comparison(FusedSide& before,
             FusedSide& after,
             const MapProfile& profile,
             const ChangeOptions& options)
      : before_(before),
        after_(after),
        profile_(profile),
        options_(options),
        window_before_(profile, {}),
        window_after_(profile, {}) {}

  Status Compare(const TileId& id, const std::function<void(const Tile&)>& on_tile) {
    const auto here = after_.Fuse(id);
    if (!here) return here.error();
    if (on_tile && *here != nullptr) on_tile(**here);
    const auto there = before_.Fuse(id);
    if (!there) return there.error();
    if (*here == nullptr || *there == nullptr) return {};
    const auto tiles_after = Around(after_, id);
    if (!tiles_after) return tiles_after.error();
    const auto tiles_before = Around(before_, id);
    if (!tiles_before) return tiles_before.error();
    const double size_m = profile_.tile_size_m();
    const Eigen::Vector3d middle((id.x + 0.5) * size_m, (id.y + 0.5) * size_m,
                                 MiddleHeight(**here));
    const double radius_m = 0.5 * size_m + options_.reach_m;
    window_before_.Renew(*tiles_before, middle, radius_m);
    window_after_.Renew(*tiles_after, middle, radius_m);
    AddStandingCells(window_after_, window_before_, id, profile_, options_, appeared_);
    AddStandingCells(window_before_, window_after_, id, profile_, options_, vanished_);
    return {};
  }

  std::vector<MapChange> Changes() && {
    const double cell_m = profile_.cell_size_m();
    auto changes = GroupCells(std::move(appeared_), ChangeKind::kAppeared, cell_m, options_);
    auto vanished = GroupCells(std::move(vanished_), ChangeKind::kVanished, cell_m, options_);
    changes.insert(changes.end(), std::make_move_iterator(vanished.begin()),
                   std::make_move_iterator(vanished.end()));
    return changes;
  }

 private:
  FusedSide& before_;
  FusedSide& after_;
  const MapProfile& profile_;
  const ChangeOptions& options_;
  MapWindow window_before_;
  MapWindow window_after_;
  std::vector<StandingCell> appeared_;
  std::vector<StandingCell> vanished_;
};

}  // namespace

Result<std::vector<MapChange>> FindChanges(
    FusedSide& before,
    FusedSide& after,
    const MapProfile& profile,
    const ChangeOptions& options,
    const std::function<void(const Tile&)>& on_tile,
    const std::function<Status(std::size_t done, std::size_t all)>& progress) {
  Comparison comparison(before, after, profile, options);
  const std::set<TileId> tiles = after.Tiles();
  std::size_t done = 0;
  for (const TileId& id : tiles) {
    Status status = comparison.Compare(id, on_tile);
    if (status.ok() && progress) status = progress(++done, tiles.size());
    if (!status.ok()) return Error(std::move(status));
  }
  return std::move(comparison).Changes();
}

}  // namespace atlas
