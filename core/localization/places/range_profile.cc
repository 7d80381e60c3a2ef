#include "core/localization/places/range_profile.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

namespace atlas {
namespace {

struct Band {
  double low_m;  // above the ground
  double high_m;
};

// Of returns; segments count where most of one lies within.
constexpr std::array<Band, RangeProfile::kBands> kBand{{{0.5, 2.0}, {2.0, 6.0}}};

RangeProfile EmptyProfile() {
  RangeProfile profile;
  for (auto& band : profile.ranges) {
    band.fill(RangeProfile::kNothing);
  }
  return profile;
}

std::uint8_t CodeOf(double range_m) {
  return static_cast<std::uint8_t>(
      std::min(range_m / RangeProfile::kStep_m, static_cast<double>(RangeProfile::kNothing)));
}

}  // namespace

RangeProfile ProfileOf(const LeveledScan& scan, double ground_z_m) {
  constexpr double kNearest_m = 2.5;  // the vehicle itself, and who stands beside it
  RangeProfile profile = EmptyProfile();
  constexpr double kSectors_a_rad =
      static_cast<double>(RangeProfile::kSectors) / (2.0 * std::numbers::pi);
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const double range_m = scan.range_m[i];
    if (scan.is_ground[i] != 0 || range_m < kNearest_m || range_m >= RangeProfile::kReach_m) {
      continue;
    }
    const double height_m = scan.z[i] - ground_z_m;
    const auto sector =
        static_cast<std::size_t>(scan.azimuth_rad[i] * kSectors_a_rad) % RangeProfile::kSectors;
    for (std::size_t band = 0; band < RangeProfile::kBands; ++band) {
      if (height_m >= kBand[band].low_m && height_m < kBand[band].high_m) {
        std::uint8_t& nearest = profile.ranges[band][sector];
        nearest = std::min(nearest, CodeOf(range_m));
      }
    }
  }
  return profile;
}

RangeProfile ProfileAt(const BlockMap& map, const Eigen::Vector3d& ground) {
  constexpr int kRays = 3;  // a sector: 1.6 m apart at 50 m
  constexpr double kNearest_m = 2.5;
  const auto base = static_cast<std::int64_t>(std::floor(ground.z() / map.segment_m()));
  std::array<std::uint64_t, RangeProfile::kBands> masks{};
  for (std::size_t band = 0; band < RangeProfile::kBands; ++band) {
    for (std::int64_t k = 0; k < 64; ++k) {
      const double middle_m = (static_cast<double>(base + k) + 0.5) * map.segment_m() - ground.z();
      if (middle_m >= kBand[band].low_m && middle_m < kBand[band].high_m) {
        masks[band] |= std::uint64_t{1} << k;
      }
    }
  }
  BlockMap::Reader reader(map);
  RangeProfile profile = EmptyProfile();
  const double step_m = map.block_m();
  for (std::size_t ray = 0; ray < kRays * RangeProfile::kSectors; ++ray) {
    const double angle = (static_cast<double>(ray) + 0.5) * 2.0 * std::numbers::pi /
                         static_cast<double>(kRays * RangeProfile::kSectors);
    const Eigen::Vector2d direction(std::cos(angle), std::sin(angle));
    std::size_t open = RangeProfile::kBands;
    std::array<bool, RangeProfile::kBands> is_hit{};
    for (double range_m = kNearest_m; range_m < RangeProfile::kReach_m && open > 0;
         range_m += step_m) {
      const Eigen::Vector2d p = ground.head<2>() + range_m * direction;
      const std::uint64_t segments = reader.SegmentsAt(p.x(), p.y(), base);
      for (std::size_t band = 0; segments != 0 && band < RangeProfile::kBands; ++band) {
        if (!is_hit[band] && (segments & masks[band]) != 0) {
          is_hit[band] = true;
          --open;
          std::uint8_t& nearest = profile.ranges[band][ray / kRays];
          nearest = std::min(nearest, CodeOf(range_m));
        }
      }
    }
  }
  return profile;
}

std::array<std::uint32_t, RangeProfile::kSectors> Differences(const RangeProfile& scan,
                                                              const RangeProfile& map) {
  constexpr std::size_t kSectors = RangeProfile::kSectors;
  constexpr int kMost = 24;
  std::array<std::uint32_t, kSectors> differences{};
  for (std::size_t band = 0; band < RangeProfile::kBands; ++band) {
    // The map's sectors twice, so that a turned scan is a run of them.
    std::array<std::uint8_t, 2 * kSectors> around;
    for (std::size_t i = 0; i < around.size(); ++i) {
      around[i] = map.ranges[band][i % kSectors];
    }
    for (std::size_t turn = 0; turn < kSectors; ++turn) {
      int sum = 0;
      for (std::size_t sector = 0; sector < kSectors; ++sector) {
        const int difference = int{scan.ranges[band][sector]} - int{around[turn + sector]};
        sum += std::min(std::abs(difference), kMost);
      }
      differences[turn] += static_cast<std::uint32_t>(sum);
    }
  }
  return differences;
}

}  // namespace atlas
