#include "core/localization/window/local_map.h"

#include <utility>

namespace atlas {

LocalMap::LocalMap(const MapProfile& profile, TilesAround tiles, const LocalMapOptions& options)
    : tiles_(std::move(tiles)), options_(options), window_(profile, options.window) {}

Status LocalMap::Renew(const Eigen::Vector3d& center, double radius_m) {
  const bool is_near = (center - center_).norm() < 0.5 * options_.margin_m;
  if (is_near && radius_m <= radius_m_) {
    return {};
  }
  const double with_margin_m = radius_m + options_.margin_m;
  const auto tiles = tiles_(center, with_margin_m);
  if (!tiles) {
    return tiles.error();
  }
  window_.Renew(*tiles, center, with_margin_m);
  coarse_.reset();
  center_ = center;
  radius_m_ = radius_m;
  return {};
}

const CoarseOccupancy& LocalMap::coarse() {
  if (!coarse_) {
    coarse_.emplace(window_, options_.coarse_block_m);
  }
  return *coarse_;
}

}  // namespace atlas
