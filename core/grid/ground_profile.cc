#include "core/grid/ground_profile.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/base/small_sort.h"

namespace atlas {
namespace {

// A slope is taken over at least this share of the gap that it is extended into, so that noise is
// not extended into slope.
constexpr float kSlopeBase = 0.5F;
// How far from a slope what was seen of it may lie: a bonnet and the roof behind it are none.
constexpr float kStraight_m = 0.15F;

using GroundSamples = std::span<const GroundSample>;

// Height of the ground at `range_m`, of which `after` is the first sample beyond.
float HeightBefore(GroundSamples ground, GroundSamples::iterator after, float range_m) {
  if (after == ground.end()) {
    return ground.back().z_m;
  }
  const GroundSample& before = *std::prev(after);  // the first sample is at range 0
  const float t = (range_m - before.range_m) / (after->range_m - before.range_m);
  return before.z_m + t * (after->z_m - before.z_m);
}

// Height at `range_m` on the line that the ground followed until its last sample.
float Extend(GroundSamples ground, float range_m) {
  const GroundSample& last = ground.back();
  const float gap_m = range_m - last.range_m;
  std::size_t first = ground.size() - 1;
  while (first > 0 && last.range_m - ground[first].range_m < kSlopeBase * gap_m) {
    --first;
  }
  const float base_m = last.range_m - ground[first].range_m;
  const float slope = base_m > 0.0F ? (last.z_m - ground[first].z_m) / base_m : 0.0F;
  return last.z_m + slope * gap_m;
}

}  // namespace

float RayProfile::GroundAt(float range_m) const {
  return HeightBefore(ground,
                      std::upper_bound(ground.begin(), ground.end(), range_m,
                                       [](float range, const GroundSample& sample) {
                                         return range < sample.range_m;
                                       }),
                      range_m);
}

GroundProfiles::GroundProfiles(const LeveledScan& scan,
                               const RayTable& rays,
                               const VehicleContact& contact,
                               const ProfileOptions& options) {
  Sort(scan, rays);
  const auto count = static_cast<std::size_t>(rays.rays());
  ground_begin_.reserve(count + 1);
  ground_begin_.push_back(0);
  for (std::size_t ray = 0; ray < count; ++ray) {
    const float azimuth_rad = (static_cast<float>(ray) + 0.5F) * rays.ray_width_rad();
    const float rim_m = options.contact_radius_m;
    ground_.push_back({0.0F, contact.HeightAt(0.0F, 0.0F)});
    ground_.push_back(
        {rim_m, contact.HeightAt(rim_m * std::cos(azimuth_rad), rim_m * std::sin(azimuth_rad))});
    BuildRay(std::span(returns_).subspan(return_begin_[ray],
                                         return_begin_[ray + 1] - return_begin_[ray]),
             options);
  }
}

RayProfile GroundProfiles::Ray(int ray) const {
  const auto r = static_cast<std::size_t>(ray);
  return {std::span(ground_).subspan(ground_begin_[r], ground_begin_[r + 1] - ground_begin_[r]),
          ends_[r], farthest_m_[r]};
}

// A return stands for every ray between it and its neighbours on the channel.
void GroundProfiles::Sort(const LeveledScan& scan, const RayTable& rays) {
  const int count = rays.rays();
  const float half = 0.5F * std::max(0.0F, scan.column_spacing_rad);
  struct Span {
    int first;
    int last;
    std::size_t source;
  };
  std::vector<Span> spans;
  spans.reserve(scan.size());
  const auto ray_below = [&rays](float azimuth_rad) {
    return static_cast<int>(std::floor(azimuth_rad / rays.ray_width_rad()));
  };
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (scan.range_m[i] < rays.radius_m()) {
      spans.push_back(
          {ray_below(scan.azimuth_rad[i] - half), ray_below(scan.azimuth_rad[i] + half), i});
    }
  }
  const auto wrap = [count](int ray) {
    return static_cast<std::size_t>(ray < 0 ? ray + count : ray >= count ? ray - count : ray);
  };
  return_begin_.assign(static_cast<std::size_t>(count) + 1, 0);
  for (const Span& span : spans) {
    for (int ray = span.first; ray <= span.last; ++ray) {
      ++return_begin_[wrap(ray) + 1];
    }
  }
  std::partial_sum(return_begin_.begin(), return_begin_.end(), return_begin_.begin());
  returns_.resize(return_begin_.back());
  std::vector<std::uint32_t> next(return_begin_.begin(), return_begin_.end() - 1);
  for (const Span& span : spans) {
    const Return r{scan.range_m[span.source], scan.z[span.source],
                   scan.is_ground[span.source] != 0};
    for (int ray = span.first; ray <= span.last; ++ray) {
      returns_[next[wrap(ray)]++] = r;
    }
  }
}

// The sensor is at height 0: a ray that ends behind a chord is lowest against it at its far end,
// one that ends within it where it ends.
void GroundProfiles::Join(std::span<const Return> returns,
                          std::span<GroundSample> ground,
                          const ProfileOptions& options) {
  std::size_t behind = returns.size();  // the first return behind the chord
  float lowest_slope = std::numeric_limits<float>::infinity();
  for (std::size_t i = ground.size() - 1; i >= 2; --i) {  // up to 1 the wheels stand on it
    const GroundSample& before = ground[i - 1];
    GroundSample& after = ground[i];
    for (; behind > 0 && returns[behind - 1].range_m > after.range_m; --behind) {
      const Return& r = returns[behind - 1];
      lowest_slope = std::min(lowest_slope, r.z_m / r.range_m);
    }
    bool is_crossed = lowest_slope * after.range_m < after.z_m - options.max_chord_error_m;
    const float slope = (after.z_m - before.z_m) / (after.range_m - before.range_m);
    for (std::size_t k = behind; k > 0 && returns[k - 1].range_m > before.range_m; --k) {
      const Return& r = returns[k - 1];
      const float chord_m = before.z_m + slope * (r.range_m - before.range_m);
      is_crossed |= r.z_m < chord_m - options.max_chord_error_m;
    }
    const float bend_m = std::abs(after.z_m - Extend(ground.first(i), after.range_m));
    after.is_joined = !is_crossed && bend_m <= options.max_chord_error_m;
  }
}

RayEnd GroundProfiles::FindEnd(std::span<const Return> returns,
                               const RayProfile& profile,
                               const ProfileOptions& options) {
  auto after = profile.ground.begin();
  for (const Return& r : returns) {
    while (after != profile.ground.end() && after->range_m <= r.range_m) {
      ++after;
    }
    const float height_m = r.z_m - HeightBefore(profile.ground, after, r.range_m);
    if (r.is_ground ? Stands(height_m, options) : height_m <= options.vehicle_clearance_m) {
      return {r.range_m, !r.is_ground};
    }
  }
  return {profile.ground.back().range_m, false};
}

bool GroundProfiles::IsOnSlope(const Return& r,
                               std::span<const Return> rising,
                               std::span<const GroundSample> ground,
                               const ProfileOptions& options) {
  const GroundSample& last = ground.back();
  const float gap_m = r.range_m - last.range_m;
  const float slope_m = SlopeFrom(rising, kSlopeBase * gap_m, options) * gap_m;
  return r.z_m <=
         std::max(Extend(ground, r.range_m), last.z_m + slope_m) + options.max_ground_step_m;
}

float GroundProfiles::SlopeFrom(std::span<const Return> from,
                                float base_m,
                                const ProfileOptions& options) {
  const Return& first = from.front();
  for (const Return& r : from) {
    if (r.is_ground && r.range_m > first.range_m && r.range_m >= first.range_m + base_m) {
      const float slope = (r.z_m - first.z_m) / (r.range_m - first.range_m);
      const auto is_off = [&](const Return& between) {
        const float above_m = between.z_m - first.z_m - slope * (between.range_m - first.range_m);
        const bool is_other_ground =
            between.is_ground && above_m > kStraight_m && above_m <= options.vehicle_clearance_m;
        return above_m < -kStraight_m || is_other_ground;
      };
      const bool is_slope = slope <= options.max_ground_slope && std::none_of(&first, &r, is_off);
      return is_slope ? slope : 0.0F;
    }
  }
  return 0.0F;
}

void GroundProfiles::BuildRay(std::span<Return> returns, const ProfileOptions& options) {
  SmallStableSort(returns.begin(), returns.end(), [](const Return& a, const Return& b) {
    return a.range_m != b.range_m ? a.range_m < b.range_m : a.z_m < b.z_m;
  });
  const std::size_t begin = ground_begin_.back();
  float highest_m = std::max(ground_[begin].z_m, ground_[begin + 1].z_m);
  std::size_t rising = returns.size();  // the first ground since the last sample that is higher
  for (std::size_t i = 0; i < returns.size(); ++i) {
    const Return& r = returns[i];
    const GroundSample last = ground_.back();
    const float reach_m =
        options.max_ground_slope * (r.range_m - last.range_m) + options.max_ground_step_m;
    if (!r.is_ground || r.range_m <= last.range_m) {
      continue;
    }
    const bool is_higher = r.z_m > highest_m + options.max_ground_step_m;
    rising = is_higher ? std::min(rising, i) : rising;
    const std::span before(ground_.data() + begin, ground_.size() - begin);
    if (std::abs(r.z_m - last.z_m) <= reach_m &&
        (!is_higher || IsOnSlope(r, returns.subspan(rising), before, options))) {
      ground_.push_back({r.range_m, r.z_m});
      highest_m = std::max(highest_m, r.z_m);
      rising = returns.size();
    }
  }
  const std::span ground(ground_.data() + begin, ground_.size() - begin);
  Join(returns, ground, options);
  ends_.push_back(FindEnd(returns, {ground, {}, 0.0F}, options));
  farthest_m_.push_back(returns.empty() ? 0.0F : returns.back().range_m);
  ground_begin_.push_back(static_cast<std::uint32_t>(ground_.size()));
}

}  // namespace atlas
