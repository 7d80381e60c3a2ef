#include "core/grid/local_grid.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace atlas {
namespace {

constexpr float kMaxAltitude_m = 32.0F;  // int16 millimetres
constexpr std::uint16_t kMaxCount = std::numeric_limits<std::uint16_t>::max();

// One cell while the rays are traced.
struct TracedCell {
  float altitude_sum_m = 0.0F;
  std::uint16_t altitudes = 0;
  AltitudeSource source = AltitudeSource::kNone;
  Occupancy occupancy = Occupancy::kUnknown;

  // A better source replaces worse ones, equals are averaged, the first 65,535 of them.
  void AddAltitude(float z_m, AltitudeSource from) {
    const bool is_other = static_cast<int>(source != AltitudeSource::kNone) &
                          static_cast<int>(source != from);  // rare, unlike either of the two
    if (is_other) {
      if (from > source) {
        return;
      }
      altitude_sum_m = 0.0F;
      altitudes = 0;
    }
    if (altitudes < kMaxCount) {
      altitude_sum_m += z_m;
      ++altitudes;
      source = from;
    }
  }
  // Hits win over misses.
  void AddMiss() { occupancy = occupancy == Occupancy::kUnknown ? Occupancy::kFree : occupancy; }
  void AddHit() { occupancy = Occupancy::kObstacle; }

  KeyframeCell Result() const {
    const float mean_m = altitude_sum_m / static_cast<float>(altitudes);
    if (source == AltitudeSource::kNone || std::abs(mean_m) >= kMaxAltitude_m) {
      return {};  // not seen, or too high or too low for the grid
    }
    return {static_cast<std::int16_t>(std::lround(mean_m * 1000.0F)), occupancy, source};
  }
};

// Each return in its own cell: ground of any deck, or an obstacle that stands on this one.
void AddReturns(const LeveledScan& scan,
                const RayTable& rays,
                const GroundProfiles& profiles,
                const ProfileOptions& options,
                std::vector<TracedCell>& cells) {
  const GridGeometry& grid = rays.grid();
  const float cells_per_m = 1.0F / static_cast<float>(grid.cell_size_m());
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (scan.range_m[i] >= rays.radius_m()) {
      continue;
    }
    const auto ix = static_cast<std::int32_t>(std::floor(scan.x[i] * cells_per_m));
    const auto iy = static_cast<std::int32_t>(std::floor(scan.y[i] * cells_per_m));
    if (!grid.Contains(ix, iy)) {
      continue;
    }
    TracedCell& cell = cells[grid.Index(ix, iy)];
    const float range_m = scan.range_m[i];
    const RayProfile profile = profiles.Ray(rays.Ray(scan.azimuth_rad[i]));
    const bool is_behind = range_m >= profile.end.range_m;  // the nearest that stands is there
    const float ground_m = is_behind ? profile.GroundAt(range_m) : 0.0F;
    if (is_behind && Stands(scan.z[i] - ground_m, options)) {
      cell.AddHit();
      cell.AddAltitude(ground_m, AltitudeSource::kExtrapolated);
    } else if (scan.is_ground[i] != 0) {
      cell.AddAltitude(scan.z[i], AltitudeSource::kMeasured);
    }
  }
}

// Of the altitudes before a ground sample: those below the vehicle its wheels measure.
AltitudeSource SourceBefore(const GroundSample& sample, const ProfileOptions& options) {
  if (sample.range_m <= options.contact_radius_m) {
    return AltitudeSource::kMeasured;
  }
  return sample.is_joined ? AltitudeSource::kInterpolated : AltitudeSource::kExtrapolated;
}

// Steps [begin, end) of a ray: altitudes on a line, free before `misses_end`.
struct RaySteps {
  int begin;
  int end;
  int misses_end;
  AltitudeSource source;
};

void AddLine(const GroundSample& from,
             float slope,
             const RaySteps& steps,
             const RayTable& rays,
             int ray,
             std::vector<TracedCell>& cells) {
  const std::uint32_t* below = rays.Cells(ray);
  for (int step = steps.begin; step < steps.end; ++step) {
    TracedCell& cell = cells[below[step]];
    cell.AddAltitude(from.z_m + slope * (rays.StepRange(step) - from.range_m), steps.source);
    if (step < steps.misses_end) {
      cell.AddMiss();
    }
  }
}

// What one ray says about the cells below it, from the sensor's foot to its farthest return.
void AddRay(const RayProfile& profile,
            const RayTable& rays,
            int ray,
            const ProfileOptions& options,
            std::vector<TracedCell>& cells) {
  const float end_m = profile.end.range_m;
  const float farthest_m = std::max(end_m, profile.farthest_m);
  const int last = std::min(rays.steps() - 1, static_cast<int>(farthest_m / rays.step_m()));
  const int misses_end = std::min(rays.steps(), static_cast<int>(end_m / rays.step_m()));
  int step = 0;
  // The first step from there on that is farther than `range_m`.
  const auto step_behind = [&](float range_m) {
    // NOLINTNEXTLINE(bugprone-incorrect-roundings): a range is not below 0
    return std::clamp(static_cast<int>(range_m / rays.step_m() + 0.5F), step, last + 1);
  };
  for (std::size_t next = 1; next < profile.ground.size() && step <= last; ++next) {
    const GroundSample& before = profile.ground[next - 1];
    const GroundSample& after = profile.ground[next];
    const float slope = (after.z_m - before.z_m) / (after.range_m - before.range_m);
    const int seen_end = step_behind(std::min(after.range_m, end_m));
    AddLine(before, slope, {step, seen_end, misses_end, SourceBefore(after, options)}, rays, ray,
            cells);
    step = seen_end;
    const int end = step_behind(after.range_m);
    AddLine(before, slope, {step, end, misses_end, AltitudeSource::kExtrapolated}, rays, ray,
            cells);
    step = end;
  }
  AddLine(profile.ground.back(), 0.0F, {step, last + 1, misses_end, AltitudeSource::kExtrapolated},
          rays, ray, cells);
  if (profile.end.is_obstacle && misses_end < rays.steps()) {
    cells[rays.Cells(ray)[misses_end]].AddHit();
  }
}

// Wheels do not measure again what a return or a later place of the trail did.
void AddPlace(const VehiclePlace& place,
              const GridGeometry& grid,
              float sensor_height_m,
              const ProfileOptions& options,
              std::vector<TracedCell>& cells) {
  options.body.ForEachCell(
      grid, place, [&](std::int32_t ix, std::int32_t iy, float x_m, float y_m) {
        TracedCell& cell = cells[grid.Index(ix, iy)];
        cell.occupancy = Occupancy::kDriven;
        if (cell.source != AltitudeSource::kMeasured) {
          cell.AddAltitude(place.GroundAt(x_m, y_m, sensor_height_m), AltitudeSource::kMeasured);
        }
      });
}

}  // namespace

LocalGrid BuildLocalGrid(const LeveledScan& scan,
                         const RayTable& rays,
                         const VehicleContact& contact,
                         std::span<const VehiclePlace> trail,
                         const ProfileOptions& options) {
  const GroundProfiles profiles(scan, rays, contact, options);
  std::vector<TracedCell> cells(rays.grid().size());
  AddReturns(scan, rays, profiles, options, cells);
  for (int ray = 0; ray < rays.rays(); ++ray) {
    AddRay(profiles.Ray(ray), rays, ray, options, cells);
  }
  for (const VehiclePlace& place : trail) {
    AddPlace(place, rays.grid(), contact.sensor_height_m, options, cells);
  }
  options.body.ForEachCell(rays.grid(), contact.Place(),
                           [&](std::int32_t ix, std::int32_t iy, float, float) {
                             cells[rays.grid().Index(ix, iy)].occupancy = Occupancy::kDriven;
                           });
  LocalGrid grid;
  grid.cells.reserve(cells.size());
  for (const TracedCell& cell : cells) {
    grid.cells.push_back(cell.Result());
  }
  return grid;
}

}  // namespace atlas
