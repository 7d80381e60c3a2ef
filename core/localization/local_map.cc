#include "core/localization/local_map.h"

#include <utility>

namespace atlas {

LocalMap::LocalMap(const MapProfile& profile, TilesAround tiles, const LocalMapOptions& options)
    : profile_(profile), tiles_(std::move(tiles)), options_(options) {}

Status LocalMap::Renew(const Eigen::Vector3d& center, double radius_m) {
  const bool is_near = (center - center_).norm() < 0.5 * options_.margin_m;
  if (window_ && is_near && radius_m <= radius_m_) {
    return {};
  }
  const double with_margin_m = radius_m + options_.margin_m;
  const auto tiles = tiles_(center, with_margin_m);
  if (!tiles) {
    return tiles.error();
  }
  std::vector<const Tile*> views;
  views.reserve(tiles->size());
  for (const auto& tile : *tiles) {
    views.push_back(tile.get());
  }
  window_.emplace(profile_, views, center, with_margin_m, options_.window);
  coarse_.reset();
  center_ = center;
  radius_m_ = radius_m;
  return {};
}

const CoarseOccupancy& LocalMap::coarse() {
  if (!coarse_) {
    coarse_.emplace(*window_, options_.coarse_block_m);
  }
  return *coarse_;
}

}  // namespace atlas
