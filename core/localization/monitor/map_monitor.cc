#include "core/localization/monitor/map_monitor.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/integer_math.h"
#include "core/geometry/nibble.h"

namespace atlas {
namespace {

std::int32_t SegmentAt(double z_m, const MapProfile& profile) {
  return static_cast<std::int32_t>(std::floor(z_m / profile.segment_height_m()));
}

// 0: no data, or a segment that the column does not have.
std::uint8_t NibbleOf(const TileLayer& layer, std::int32_t segment, const MapProfile& profile) {
  const std::int32_t k = segment - ColumnBaseIndex(layer.altitude_mm, profile);
  return k >= 0 && k < profile.column_segments ? NibbleAt(layer.column, k) : std::uint8_t{0};
}

}  // namespace

MapMonitor::MapMonitor(const MapProfile& profile,
                       TilesAround tiles,
                       const MonitorOptions& options,
                       OnContradiction on_contradiction)
    : profile_(profile),
      tiles_(std::move(tiles)),
      options_(options),
      on_contradiction_(std::move(on_contradiction)),
      sight_(options.sight,
             static_cast<float>(profile.cell_size_m()),
             static_cast<float>(profile.segment_height_m())) {}

Status MapMonitor::Observe(const LeveledScan& leveled,
                           const Pose& T_world_level,
                           const PoseCovariance& covariance,
                           std::uint32_t scan) {
  const bool is_witness = SpreadOf(covariance).along_m <= options_.max_sigma_m &&
                          covariance(3, 3) <= options_.max_sigma_rad * options_.max_sigma_rad;
  if (!is_witness) {
    return {};
  }
  const Eigen::Vector3d place = T_world_level.translation();
  ATLAS_RETURN_IF_ERROR(Renew(place));
  ++scans_;
  Drive(place);
  sight_.Assign(leveled, T_world_level);
  const SightOptions& sight = options_.sight;
  for (std::size_t i = 0; i < leveled.size(); ++i) {
    const bool is_seen = leveled.is_ground[i] == 0 && leveled.range_m[i] >= sight.min_range_m &&
                         leveled.range_m[i] <= sight.max_range_m;
    if (is_seen) {
      AddReturn(
          T_world_level * Eigen::Vector3f(leveled.x[i], leveled.y[i], leveled.z[i]).cast<double>(),
          scan);
    }
  }
  for (const auto& tile : watched_) {
    tile->Observe(sight_, scan);
  }
  return {};
}

void MapMonitor::Finish() {
  for (const auto& tile : watched_) {
    Report(*tile);
  }
  watched_.clear();
  grid_.clear();
  center_.reset();
}

bool MapMonitor::IsNear(const TileId& id, const Eigen::Vector3d& center) const {
  const double half_m = 0.5 * profile_.tile_size_m();
  const Eigen::Vector2d middle(2.0 * half_m * id.x + half_m, 2.0 * half_m * id.y + half_m);
  const Eigen::Vector2d beyond = ((center.head<2>() - middle).cwiseAbs().array() - half_m).max(0.0);
  return beyond.norm() <= static_cast<double>(options_.sight.max_range_m) + options_.margin_m;
}

Status MapMonitor::Renew(const Eigen::Vector3d& center) {
  if (center_ && (center - *center_).norm() < 0.5 * options_.margin_m) {
    return {};
  }
  const auto tiles =
      tiles_(center, static_cast<double>(options_.sight.max_range_m) + options_.margin_m);
  if (!tiles) {
    return tiles.error();
  }
  center_ = center;
  const auto behind =
      std::stable_partition(watched_.begin(), watched_.end(),
                            [&](const auto& tile) { return IsNear(tile->id(), center); });
  std::for_each(behind, watched_.end(), [&](const auto& tile) { Report(*tile); });
  watched_.erase(behind, watched_.end());
  const std::size_t kept = watched_.size();
  for (const auto& tile : *tiles) {
    const bool is_watched =
        std::any_of(watched_.begin(), watched_.begin() + static_cast<std::ptrdiff_t>(kept),
                    [&](const auto& other) { return other->id() == tile->id; });
    if (!is_watched && tile->id.level == 0 && IsNear(tile->id, center)) {
      watched_.push_back(std::make_unique<WatchedTile>(tile, profile_, options_.watch));
    }
  }
  std::sort(watched_.begin(), watched_.end(),
            [](const auto& a, const auto& b) { return a->id().Key() < b->id().Key(); });
  Arrange();
  return {};
}

void MapMonitor::Arrange() {
  grid_.clear();
  width_ = 0;
  if (watched_.empty()) {
    return;
  }
  const auto [low_x, high_x] = std::minmax_element(
      watched_.begin(), watched_.end(), [](auto& a, auto& b) { return a->id().x < b->id().x; });
  const auto [low_y, high_y] = std::minmax_element(
      watched_.begin(), watched_.end(), [](auto& a, auto& b) { return a->id().y < b->id().y; });
  first_x_ = (*low_x)->id().x;
  first_y_ = (*low_y)->id().y;
  width_ = (*high_x)->id().x - first_x_ + 1;
  grid_.resize(static_cast<std::size_t>(width_ * ((*high_y)->id().y - first_y_ + 1)), nullptr);
  for (const auto& tile : watched_) {
    const std::int64_t at = (tile->id().y - first_y_) * width_ + tile->id().x - first_x_;
    grid_[static_cast<std::size_t>(at)] = tile.get();
  }
}

std::optional<MapMonitor::CellPlace> MapMonitor::Find(std::int64_t cell_x,
                                                      std::int64_t cell_y) const {
  const std::int64_t side = profile_.tile_cells;
  const std::int64_t x = cell_x - first_x_ * side;
  const std::int64_t y = cell_y - first_y_ * side;
  if (x < 0 || y < 0 || x >= width_ * side) {
    return std::nullopt;
  }
  const auto at = static_cast<std::size_t>(y / side * width_ + x / side);
  if (at >= grid_.size() || grid_[at] == nullptr) {
    return std::nullopt;
  }
  return CellPlace{grid_[at], static_cast<std::size_t>(y % side * side + x % side)};
}

void MapMonitor::AddReturn(const Eigen::Vector3d& p_world, std::uint32_t scan) {
  const double cell_m = profile_.cell_size_m();
  const auto place = Find(static_cast<std::int64_t>(std::floor(p_world.x() / cell_m)),
                          static_cast<std::int64_t>(std::floor(p_world.y() / cell_m)));
  if (!place) {
    return;
  }
  const double z_m = p_world.z();
  const std::int32_t segment = SegmentAt(z_m, profile_);
  const auto is_free = [&](std::uint8_t nibble) {
    return nibble != 0 && nibble <= options_.watch.free_nibble;
  };
  const auto layers = place->tile->Layers(place->cell);
  for (const TileLayer& layer : layers) {
    const double foot_m =
        (layer.altitude_mm + profile_.column_base_offset_mm) * 1e-3 + options_.foot_m;
    if (z_m < foot_m || !IsBelieved(layer, layers) ||
        !is_free(NibbleOf(layer, segment, profile_))) {
      continue;
    }
    const double half_m = 0.5 * profile_.segment_height_m();
    if (!IsNearStructure(p_world.head<2>(), options_.structure_reach_m, z_m - half_m,
                         z_m + half_m)) {
      const double middle_m = (segment + 0.5) * profile_.segment_height_m();
      place->tile->AddAppearance(place->cell, layer, segment,
                                 z_m < middle_m ? kLowerHalf : kUpperHalf, scan);
    }
    return;
  }
}

bool MapMonitor::IsNearStructure(const Eigen::Vector2d& p_world,
                                 double reach_m,
                                 double low_m,
                                 double high_m) const {
  const double cell_m = profile_.cell_size_m();
  const auto index = [cell_m](double v) {
    return static_cast<std::int64_t>(std::floor(v / cell_m));
  };
  // From the point to the nearest place of a cell, along one axis.
  const auto gap = [cell_m](double v, std::int64_t cell) {
    const double edge_m = static_cast<double>(cell) * cell_m;
    return std::max({0.0, edge_m - v, v - edge_m - cell_m});
  };
  for (std::int64_t y = index(p_world.y() - reach_m); y <= index(p_world.y() + reach_m); ++y) {
    for (std::int64_t x = index(p_world.x() - reach_m); x <= index(p_world.x() + reach_m); ++x) {
      const bool is_near = std::hypot(gap(p_world.x(), x), gap(p_world.y(), y)) <= reach_m;
      if (is_near && IsOccupied(x, y, low_m, high_m)) {
        return true;
      }
    }
  }
  return false;
}

PlaceContext MapMonitor::ContextOf(const Eigen::Vector3d& p_world) const {
  const double height_m = profile_.segment_height_m();
  const bool is_beside = IsNearStructure(p_world.head<2>(), options_.beside_reach_m,
                                         p_world.z() - height_m, p_world.z() + height_m);
  return {IsDriven(p_world), is_beside};
}

bool MapMonitor::IsOccupied(std::int64_t cell_x,
                            std::int64_t cell_y,
                            double low_m,
                            double high_m) const {
  const auto place = Find(cell_x, cell_y);
  if (!place) {
    return false;
  }
  const auto layers = place->tile->Layers(place->cell);
  return std::any_of(layers.begin(), layers.end(), [&](const TileLayer& layer) {
    for (std::int32_t s = SegmentAt(low_m, profile_); s <= SegmentAt(high_m, profile_); ++s) {
      if (NibbleOf(layer, s, profile_) >= options_.watch.occupied_nibble) {
        return true;
      }
    }
    return false;
  });
}

void MapMonitor::Report(const WatchedTile& tile) const {
  tile.Report(
      options_.evidence, [this](const Eigen::Vector3d& p_world) { return ContextOf(p_world); },
      on_contradiction_);
}

void MapMonitor::Drive(const Eigen::Vector3d& place) {
  if (!trail_.empty() && (trail_.back() - place).norm() < options_.trail_step_m) {
    return;
  }
  trail_.push_back(place);
  if (trail_.size() > options_.max_trail) {
    trail_.pop_front();
  }
}

bool MapMonitor::IsDriven(const Eigen::Vector3d& p_world) const {
  constexpr double kDeck_m = 3.0;  // further below is another deck
  const VehicleBody body;
  return std::any_of(trail_.begin(), trail_.end(), [&](const Eigen::Vector3d& place) {
    const Eigen::Vector3d away = p_world - place;
    return away.head<2>().norm() <= static_cast<double>(body.half_width_m) &&
           away.z() <= static_cast<double>(body.clearance_m) && away.z() >= -kDeck_m;
  });
}

}  // namespace atlas
