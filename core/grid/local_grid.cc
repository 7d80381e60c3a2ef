#include "core/grid/local_grid.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace atlas {
namespace {

constexpr float kMaxAltitude_m = 32.0F;  // int16 millimetres
constexpr std::uint16_t kMaxCount = std::numeric_limits<std::uint16_t>::max();

struct AltitudeSum {
  float sum_m = 0.0F;
  std::uint16_t count = 0;
  AltitudeSource source = AltitudeSource::kNone;
};

// Collects altitudes; a better source replaces worse ones, equals are averaged, the first 65,535 of
// them.
class AltitudeGrid {
 public:
  explicit AltitudeGrid(std::size_t size) : cells_(size) {}

  void Add(std::uint32_t cell, float z_m, AltitudeSource source) {
    AltitudeSum& sum = cells_[cell];
    if (sum.source == AltitudeSource::kNone || source < sum.source) {
      sum = {z_m, 1, source};
    } else if (source == sum.source && sum.count < kMaxCount) {
      sum.sum_m += z_m;
      ++sum.count;
    }
  }

  void Store(std::vector<KeyframeCell>& cells) const {
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      const AltitudeSum& sum = cells_[i];
      if (sum.source == AltitudeSource::kNone) {
        continue;
      }
      const float mean_m = sum.sum_m / static_cast<float>(sum.count);
      if (std::abs(mean_m) < kMaxAltitude_m) {
        cells[i].altitude_mm = static_cast<std::int16_t>(std::lround(mean_m * 1000.0F));
        cells[i].source = sum.source;
      }
    }
  }

 private:
  std::vector<AltitudeSum> cells_;
};

// Each return in its own cell: ground of any deck, or an obstacle that stands on this one.
void AddReturns(const LeveledScan& scan,
                const RayTable& rays,
                const GroundProfiles& profiles,
                const ProfileOptions& options,
                AltitudeGrid& altitudes,
                std::vector<KeyframeCell>& cells) {
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
    const auto cell = static_cast<std::size_t>(grid.Index(ix, iy));
    const float range_m = scan.range_m[i];
    const RayProfile profile = profiles.Ray(rays.Ray(scan.azimuth_rad[i]));
    const bool is_behind = range_m >= profile.end.range_m;  // the nearest that stands is there
    const float ground_m = is_behind ? profile.GroundAt(range_m) : 0.0F;
    if (is_behind && Stands(scan.z[i] - ground_m, options)) {
      cells[cell].occupancy = Occupancy::kObstacle;
      altitudes.Add(static_cast<std::uint32_t>(cell), ground_m, AltitudeSource::kExtrapolated);
    } else if (scan.is_ground[i] != 0) {
      altitudes.Add(static_cast<std::uint32_t>(cell), scan.z[i], AltitudeSource::kMeasured);
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

// Altitudes below one ray, from the sensor's foot to its farthest return.
void AddAlongRay(const RayProfile& profile,
                 const RayTable& rays,
                 int ray,
                 const ProfileOptions& options,
                 AltitudeGrid& altitudes) {
  const std::uint32_t* cells = rays.Cells(ray);
  const float end_m = std::max(profile.end.range_m, profile.farthest_m);
  const int last = std::min(rays.steps() - 1, static_cast<int>(end_m / rays.step_m()));
  std::size_t next = 1;
  for (int step = 0; step <= last; ++step) {
    const float range_m = rays.StepRange(step);
    while (next < profile.ground.size() && profile.ground[next].range_m < range_m) {
      ++next;
    }
    const GroundSample& before = profile.ground[next - 1];
    if (next == profile.ground.size()) {
      altitudes.Add(cells[step], before.z_m, AltitudeSource::kExtrapolated);
      continue;
    }
    const GroundSample& after = profile.ground[next];
    const float t = (range_m - before.range_m) / (after.range_m - before.range_m);
    altitudes.Add(cells[step], before.z_m + t * (after.z_m - before.z_m),
                  range_m <= profile.end.range_m ? SourceBefore(after, options)
                                                 : AltitudeSource::kExtrapolated);
  }
}

}  // namespace

LocalGrid BuildLocalGrid(const LeveledScan& scan,
                         const RayTable& rays,
                         const VehicleContact& contact,
                         const ProfileOptions& options) {
  const GroundProfiles profiles(scan, rays, contact, options);
  LocalGrid grid;
  grid.cells.resize(rays.grid().size());
  AltitudeGrid altitudes(rays.grid().size());
  AddReturns(scan, rays, profiles, options, altitudes, grid.cells);
  for (int ray = 0; ray < rays.rays(); ++ray) {  // hits first
    const RayProfile profile = profiles.Ray(ray);
    AddAlongRay(profile, rays, ray, options, altitudes);
    const int step = static_cast<int>(profile.end.range_m / rays.step_m());
    if (profile.end.is_obstacle && step < rays.steps()) {
      grid.cells[rays.Cells(ray)[step]].occupancy = Occupancy::kObstacle;
    }
  }
  for (int ray = 0; ray < rays.rays(); ++ray) {
    const int end =
        std::min(rays.steps(), static_cast<int>(profiles.Ray(ray).end.range_m / rays.step_m()));
    const std::uint32_t* cells = rays.Cells(ray);
    for (int step = 0; step < end; ++step) {
      KeyframeCell& cell = grid.cells[cells[step]];
      cell.occupancy = cell.occupancy == Occupancy::kUnknown ? Occupancy::kFree : cell.occupancy;
    }
  }
  options.body.ForEachCell(rays.grid(), [&](std::int32_t ix, std::int32_t iy) {
    grid.cells[rays.grid().Index(ix, iy)].occupancy = Occupancy::kDriven;
  });
  altitudes.Store(grid.cells);
  for (KeyframeCell& cell : grid.cells) {
    if (cell.source == AltitudeSource::kNone) {
      cell.occupancy = Occupancy::kUnknown;  // too high or too low for the grid
    }
  }
  return grid;
}

}  // namespace atlas
