// What the rays of a scan passed through: half segments above each step of each azimuth.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/column/half_segments.h"
#include "core/scan/ray_table.h"

namespace atlas {

class PolarMisses {
 public:
  PolarMisses(const RayTable& rays, const HalfSegments& halves)
      : rays_(rays),
        halves_(halves),
        masks_(static_cast<std::size_t>(rays.rays()) * static_cast<std::size_t>(rays.steps())),
        reach_(static_cast<std::size_t>(rays.rays())) {}

  // A ray from the sensor to a return at horizontal distance `range_m` and height `z_m`; it ends a
  // cell before the return.
  void Add(float azimuth_rad, float range_m, float z_m) {
    const int ray = rays_.Ray(azimuth_rad);
    const float cell_m = static_cast<float>(rays_.grid().cell_size_m());
    const float end_m = std::min(range_m - cell_m, rays_.radius_m());
    const int end = std::min(rays_.steps(), static_cast<int>(end_m / rays_.step_m()));
    if (end <= 0) {
      return;
    }
    int& reach = reach_[static_cast<std::size_t>(ray)];
    reach = std::max(reach, end);
    Fill(masks_.data() + static_cast<std::size_t>(ray) * static_cast<std::size_t>(rays_.steps()),
         end, z_m / range_m);
  }

  // Calls visit(cell, mask) for every step that was passed.
  template <typename Visit>
  void ForEach(Visit&& visit) const {
    for (int ray = 0; ray < rays_.rays(); ++ray) {
      const HalfMask* masks =
          masks_.data() + static_cast<std::size_t>(ray) * static_cast<std::size_t>(rays_.steps());
      const std::uint32_t* cells = rays_.Cells(ray);
      for (int step = 0; step < reach_[static_cast<std::size_t>(ray)]; ++step) {
        visit(cells[step], masks[step]);
      }
    }
  }

 private:
  void Fill(HalfMask* masks, int end, float slope) const;

  const RayTable& rays_;
  HalfSegments halves_;
  std::vector<HalfMask> masks_;
  std::vector<int> reach_;  // steps in use, by ray
};

}  // namespace atlas
