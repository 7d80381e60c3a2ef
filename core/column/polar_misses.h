// What the rays of a scan passed through: half segments above each step of each azimuth.
#pragma once

#include <algorithm>
#include <cmath>
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
  // The ray rises (or falls) through one half segment after the other.
  void Fill(HalfMask* masks, int end, float slope) const {
    const float halves_per_step = std::abs(slope) * rays_.step_m() / halves_.half_height_m();
    const float steps_per_half = halves_per_step > 1e-6F ? 1.0F / halves_per_step : 1e9F;
    const int direction = slope < 0.0F ? -1 : 1;
    int half = slope < 0.0F ? -1 : 0;  // the sensor is on the border between these two
    float border = steps_per_half;     // in steps from the sensor
    for (int begin = 0; begin < end; half += direction) {
      if (halves_.IsPast(half, direction)) {
        return;
      }
      const HalfMask bit = halves_.Bit(half);
      const int stop = border < static_cast<float>(end) ? static_cast<int>(border) : end;
      for (int step = begin; step < stop; ++step) {
        masks[step] |= bit;
      }
      begin = stop;
      border += steps_per_half;
    }
  }

  const RayTable& rays_;
  HalfSegments halves_;
  std::vector<HalfMask> masks_;
  std::vector<int> reach_;  // steps in use, by ray
};

}  // namespace atlas
