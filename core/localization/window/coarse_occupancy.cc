#include "core/localization/window/coarse_occupancy.h"

#include <algorithm>
#include <cmath>

namespace atlas {

CoarseOccupancy::CoarseOccupancy(const MapWindow& map, float block_m)
    : block_m_(block_m),
      segment_height_m_(map.segment_height_m()),
      side_(static_cast<std::int32_t>(std::ceil(map.side_m() / block_m)) + 1),
      masks_(static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_)) {
  map.ForEachOccupied([this](const Eigen::Vector2f& center, std::uint64_t segments) {
    const auto x = static_cast<std::int32_t>(center.x() / block_m_);
    const auto y = static_cast<std::int32_t>(center.y() / block_m_);
    for (std::int32_t j = std::max(0, y - 1); j <= std::min(side_ - 1, y + 1); ++j) {
      for (std::int32_t i = std::max(0, x - 1); i <= std::min(side_ - 1, x + 1); ++i) {
        masks_[static_cast<std::size_t>(j * side_ + i)] |= segments;
      }
    }
  });
}

bool CoarseOccupancy::IsOccupied(const Eigen::Vector3f& p) const {
  constexpr float kSegments = 64.0F;
  const float x = p.x() / block_m_;
  const float y = p.y() / block_m_;
  const float segment = p.z() / segment_height_m_;
  const auto side = static_cast<float>(side_);
  if (!(x >= 0.0F && x < side && y >= 0.0F && y < side && segment >= 0.0F && segment < kSegments)) {
    return false;
  }
  const auto index =
      static_cast<std::size_t>(static_cast<std::int32_t>(y) * side_ + static_cast<std::int32_t>(x));
  return ((masks_[index] >> static_cast<int>(segment)) & 1) != 0;
}

}  // namespace atlas
