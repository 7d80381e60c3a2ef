// The returns of a levelled scan by azimuth: what was measured around a direction.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include "core/scan/leveled_scan.h"

namespace atlas {

class ScanSectors {
 public:
  struct Return {
    float azimuth_rad = 0.0F;
    float slope = 0.0F;    // of the ray: height over horizontal distance
    float range_m = 0.0F;  // horizontal
    bool is_ground = false;
  };

  // All returns of `scan` but those nearer than `min_range_m`. Keeps its memory.
  void Assign(const LeveledScan& scan, float min_range_m);

  struct Window {
    float azimuth_rad;     // its middle, in [0, 2 pi)
    float half_width_rad;  // up to pi
    float low_slope;
    float high_slope;
    float min_range_m;  // is looked into if anything there is that far away
  };
  // Calls visit(return, its angle from the window's middle) for those within; where it is wide, for
  // those of kMaxSectors directions in it.
  template <typename Visit>
  void ForEach(const Window& window, Visit&& visit) const {
    const Sectors sectors = Around(window);
    if (!Reaches(sectors, window.min_range_m)) {
      return;
    }
    for (std::int32_t k = sectors.first; k <= sectors.last; k += sectors.step) {
      const std::span<const Return> returns = Of(k);
      auto r = std::partition_point(returns.begin(), returns.end(), [&](const Return& other) {
        return other.slope < window.low_slope;
      });
      for (; r != returns.end() && r->slope <= window.high_slope; ++r) {
        const float angle_rad = AngleBetween(r->azimuth_rad, window.azimuth_rad);
        if (angle_rad <= window.half_width_rad) {
          visit(*r, angle_rad);
        }
      }
    }
  }

 private:
  static constexpr float kTurn = 2.0F * std::numbers::pi_v<float>;
  static constexpr std::int32_t kMaxSectors = 5;

  // The short way round.
  static float AngleBetween(float a_rad, float b_rad) {
    const float turn = std::abs(a_rad - b_rad);
    return turn > 0.5F * kTurn ? kTurn - turn : turn;
  }

  struct Sectors {
    std::int32_t first;
    std::int32_t last;
    std::int32_t step;
  };
  Sectors Around(const Window& window) const;
  bool Reaches(const Sectors& sectors, float range_m) const;
  std::span<const Return> Of(std::int32_t sector) const {
    const auto k = static_cast<std::size_t>(sector & (sectors_ - 1));
    return std::span(returns_).subspan(begin_[k], begin_[k + 1] - begin_[k]);
  }

  std::int32_t sectors_ = 0;  // a power of two; none narrower than a channel's returns are apart
  std::vector<std::uint32_t> begin_;  // by sector, plus one
  std::vector<float> reach_m_;        // by sector: its farthest return
  std::vector<Return> returns_;       // by sector and slope
  std::vector<std::uint32_t> next_;
};

}  // namespace atlas
