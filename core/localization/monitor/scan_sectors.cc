#include "core/localization/monitor/scan_sectors.h"

#include <algorithm>
#include <cmath>

namespace atlas {
namespace {

// Of a scan whose channels have returns so far apart.
std::int32_t SectorsFor(float column_spacing_rad, float turn_rad) {
  constexpr std::int32_t kMost = 2048;
  constexpr std::int32_t kLeast = 256;
  std::int32_t sectors = kMost;
  while (sectors > kLeast && turn_rad < static_cast<float>(sectors) * column_spacing_rad) {
    sectors /= 2;
  }
  return sectors;
}

// By insertion: they are almost in order.
void SortBySlope(std::span<ScanSectors::Return> returns) {
  for (std::size_t i = 1; i < returns.size(); ++i) {
    const ScanSectors::Return moved = returns[i];
    std::size_t at = i;
    for (; at > 0 && returns[at - 1].slope > moved.slope; --at) {
      returns[at] = returns[at - 1];
    }
    returns[at] = moved;
  }
}

}  // namespace

void ScanSectors::Assign(const LeveledScan& scan, float min_range_m) {
  sectors_ = SectorsFor(scan.column_spacing_rad, kTurn);
  const float per_rad = static_cast<float>(sectors_) / kTurn;
  const auto sector_of = [&](float azimuth_rad) {
    return static_cast<std::size_t>(static_cast<std::int32_t>(azimuth_rad * per_rad) &
                                    (sectors_ - 1));
  };
  begin_.assign(static_cast<std::size_t>(sectors_) + 1, 0);
  reach_m_.assign(static_cast<std::size_t>(sectors_), 0.0F);
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (scan.range_m[i] >= min_range_m) {
      ++begin_[sector_of(scan.azimuth_rad[i]) + 1];
    }
  }
  for (std::size_t k = 1; k < begin_.size(); ++k) {
    begin_[k] += begin_[k - 1];
  }
  returns_.resize(begin_.back());
  next_.assign(begin_.begin(), begin_.end() - 1);
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const float range_m = scan.range_m[i];
    if (range_m >= min_range_m) {
      const std::size_t k = sector_of(scan.azimuth_rad[i]);
      returns_[next_[k]++] = {scan.azimuth_rad[i], scan.z[i] / range_m, range_m,
                              scan.is_ground[i] != 0};
      reach_m_[k] = std::max(reach_m_[k], range_m);
    }
  }
  // Rings come lowest first, so that there is next to nothing to do.
  for (std::size_t k = 0; k + 1 < begin_.size(); ++k) {
    SortBySlope(std::span(returns_).subspan(begin_[k], begin_[k + 1] - begin_[k]));
  }
}

ScanSectors::Sectors ScanSectors::Around(const Window& window) const {
  const float per_rad = static_cast<float>(sectors_) / kTurn;
  const auto sector = [per_rad](float azimuth_rad) {
    return static_cast<std::int32_t>(std::floor(azimuth_rad * per_rad));
  };
  const std::int32_t middle = sector(window.azimuth_rad);
  const std::int32_t first = sector(window.azimuth_rad - window.half_width_rad);
  const std::int32_t last = sector(window.azimuth_rad + window.half_width_rad);
  const std::int32_t step = (last - first) / kMaxSectors + 1;
  // The middle one is among them.
  return {middle - (middle - first) / step * step, last, step};
}

bool ScanSectors::Reaches(const Sectors& sectors, float range_m) const {
  for (std::int32_t k = sectors.first; k <= sectors.last; k += sectors.step) {
    if (reach_m_[static_cast<std::size_t>(k & (sectors_ - 1))] >= range_m) {
      return true;
    }
  }
  return false;
}

}  // namespace atlas
