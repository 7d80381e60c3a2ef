#include "tests/core/fusion/random_drives.h"

#include <algorithm>
#include <random>
#include <utility>

#include "core/base/str_cat.h"

namespace atlas::testing {
namespace {

std::uint32_t Draw(std::mt19937& random, std::uint32_t count) {
  return static_cast<std::uint32_t>(random() % count);
}

// Grounds of 40 mm noise on three decks, so that layers join, split and straddle the gates.
void FlattenAltitudes(Keyframe& keyframe, std::mt19937& random) {
  for (KeyframeCell& cell : keyframe.cells) {
    if (cell.source != AltitudeSource::kNone) {
      const bool is_outlier = random() % 20 == 0;
      const auto noise = static_cast<int>(random() % (is_outlier ? 5'000 : 40));
      cell.altitude_mm = static_cast<std::int16_t>(-1'700 + noise);
    }
  }
}

}  // namespace

MapProfile DrivesProfile(std::uint32_t seed) {
  MapProfile profile;
  profile.tile_cells = 16;
  profile.column_segments = static_cast<std::uint8_t>(2u << (seed % 4));
  profile.segment_height_mm = seed % 3 == 0 ? 1'000 : 500;
  profile.stretch_keyframes = 16;
  profile.preset = seed % 4 == 1 ? FusionPreset::kBounded : FusionPreset::kStrict;
  profile.band_segments = 3;
  profile.band_vehicle_segments = 2;
  profile.driven_hold_ms = seed % 5 == 0 ? 60'000 : 600;
  return profile;
}

std::vector<PlacedKeyframe> RandomDrives(const MapProfile& profile, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<PlacedKeyframe> keyframes;
  const std::uint32_t sessions = 1 + Draw(random, 5);
  for (std::uint32_t s = 0; s < sessions; ++s) {
    std::uint32_t sequence = Draw(random, 10);
    const std::uint32_t count = 1 + Draw(random, 8);
    for (std::uint32_t i = 0; i < count; ++i) {
      const auto radius = static_cast<std::int32_t>(6 + random() % 14);
      Keyframe keyframe = RandomKeyframe(profile, radius, random() & 0xFFFFFFFF);
      FlattenAltitudes(keyframe, random);
      const double deck_m = 1.3 * static_cast<double>(random() % 4);
      const MapPose pose{0.8 + unit(random), 0.8 + unit(random), deck_m, 180.0 * unit(random)};
      const FrameName name{StrCat("car", s % 2), StrCat("s", s), sequence};
      keyframes.push_back(PlacedFrame(name, pose, std::move(keyframe)));
      keyframes.back().placement.slope_x = static_cast<std::int32_t>(3e7 * unit(random));
      keyframes.back().placement.slope_y = static_cast<std::int32_t>(3e7 * unit(random));
      if (random() % 4 == 0) {
        keyframes.back().time_ms -= 500;
      }
      sequence += 1 + Draw(random, 5);
    }
  }
  std::shuffle(keyframes.begin(), keyframes.end(), random);
  return keyframes;
}

}  // namespace atlas::testing
