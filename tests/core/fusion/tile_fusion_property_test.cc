// What must hold for any keyframes: order does not matter, tile borders do not show, far away is
// like here, resampling agrees with doubles, and the product equals its slow reference.
#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/fusion/tile_fusion.h"
#include "core/tile/tile_codec.h"
#include "tests/core/fusion/reference_fusion.h"
#include "tests/core/support/keyframe_worlds.h"

namespace atlas {
namespace {

MapProfile ProfileOf(std::uint32_t seed) {
  MapProfile profile;
  profile.tile_cells = 16;
  profile.column_segments = static_cast<std::uint8_t>(2u << (seed % 4));
  profile.segment_height_mm = seed % 3 == 0 ? 1'000 : 500;
  return profile;
}

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

// Some sessions of some vehicles on several decks, in random order, with gaps in their sequences
// and times that do not always follow them.
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
      Keyframe keyframe = testing::RandomKeyframe(profile, radius, random() & 0xFFFFFFFF);
      FlattenAltitudes(keyframe, random);
      const double deck_m = 1.3 * static_cast<double>(random() % 4);
      const testing::MapPose pose{0.8 + unit(random), 0.8 + unit(random), deck_m,
                                  180.0 * unit(random)};
      const testing::FrameName name{"car" + std::to_string(s % 2), "s" + std::to_string(s),
                                    sequence};
      keyframes.push_back(testing::PlacedFrame(name, pose, std::move(keyframe)));
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

TEST(TileFusionPropertyTest, EqualsTheReference) {
  std::size_t upper_layers = 0;
  std::size_t columns = 0;
  for (std::uint32_t seed = 0; seed < 60; ++seed) {
    const MapProfile profile = ProfileOf(seed);
    const auto keyframes = RandomDrives(profile, seed);
    const TileId id{0, seed % 5 == 0 ? -1 : 0, 0};
    const Tile tile = FuseTile(id, keyframes, profile);
    const Tile expected = testing::ReferenceFuseTile(id, keyframes, profile);
    ASSERT_EQ(tile.contributors, expected.contributors) << "seed " << seed;
    ASSERT_EQ(tile.cell_begin, expected.cell_begin) << "seed " << seed;
    for (std::size_t i = 0; i < tile.layers.size(); ++i) {
      ASSERT_EQ(tile.layers[i].altitude_mm, expected.layers[i].altitude_mm) << seed << ' ' << i;
      ASSERT_EQ(tile.layers[i].occupancy, expected.layers[i].occupancy) << seed << ' ' << i;
      ASSERT_EQ(tile.layers[i].column, expected.layers[i].column) << seed << ' ' << i;
      ASSERT_EQ(tile.layers[i], expected.layers[i]) << seed << ' ' << i;
      columns += tile.layers[i].column != 0 ? 1u : 0u;
    }
    for (std::size_t cell = 0; cell < 256; ++cell) {
      upper_layers += std::max<std::size_t>(tile.Layers(cell).size(), 1) - 1;
    }
  }
  EXPECT_GT(upper_layers, 5'000u);  // the worlds are as hard as they are meant to be
  EXPECT_GT(columns, 5'000u);
}

TEST(TileFusionPropertyTest, TheOrderOfKeyframesDoesNotMatter) {
  for (std::uint32_t seed = 100; seed < 130; ++seed) {
    const MapProfile profile = ProfileOf(seed);
    auto keyframes = RandomDrives(profile, seed);
    const Bytes payload = EncodeTilePayload(FuseTile({0, 0, 0}, keyframes, profile), profile);
    std::mt19937 random(seed);
    for (int i = 0; i < 5; ++i) {
      std::shuffle(keyframes.begin(), keyframes.end(), random);
      EXPECT_EQ(EncodeTilePayload(FuseTile({0, 0, 0}, keyframes, profile), profile), payload);
    }
  }
}

TEST(TileFusionPropertyTest, TilesAreValidAndReadBack) {
  for (std::uint32_t seed = 200; seed < 230; ++seed) {
    const MapProfile profile = ProfileOf(seed);
    const Tile tile = FuseTile({0, 0, 0}, RandomDrives(profile, seed), profile);
    const auto decoded = DecodeTile(EncodeTile(tile, profile).blob, profile);
    ASSERT_TRUE(decoded.has_value()) << decoded.error().message();
    EXPECT_EQ(*decoded, tile);
    EXPECT_EQ(tile.is_empty(), tile.contributors.empty());
  }
}

TEST(TileFusionPropertyTest, KeyframesThatDoNotReachTheTileAreIgnored) {
  const MapProfile profile = ProfileOf(0);
  auto keyframes = RandomDrives(profile, 7);
  const Tile tile = FuseTile({0, 0, 0}, keyframes, profile);
  for (const double x_m : {-3.0, 4.2, 9e6, -9e6}) {
    keyframes.push_back(testing::PlacedFrame({"car0", "s0", 900}, {x_m, 0.8},
                                             testing::RandomKeyframe(profile, 16, 1)));
  }
  EXPECT_EQ(FuseTile({0, 0, 0}, keyframes, profile), tile);
}

TEST(TileFusionPropertyTest, AKeyframeReachesNoTileBeyondItsFootprint) {
  const MapProfile profile = ProfileOf(0);
  std::mt19937 random(8);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int i = 0; i < 20; ++i) {
    Keyframe keyframe = testing::BlankKeyframe(profile, 21);
    keyframe.cells.assign(keyframe.cells.size(), {0, Occupancy::kFree, AltitudeSource::kMeasured});
    const testing::MapPose pose{2 * unit(random), 2 * unit(random), 0.0, 180.0 * unit(random)};
    const PlacedKeyframe placed = testing::PlacedFrame({}, pose, std::move(keyframe));
    const auto footprint = FootprintTiles(placed.placement, placed.keyframe->grid, profile);
    for (std::int32_t y = -4; y < 4; ++y) {
      for (std::int32_t x = -4; x < 4; ++x) {
        const TileId id{0, x, y};
        if (!FuseTile(id, std::span(&placed, 1), profile).is_empty()) {
          EXPECT_EQ(std::count(footprint.begin(), footprint.end(), id), 1) << id;
        }
      }
    }
  }
}

TEST(TileFusionPropertyTest, TileBordersDoNotShow) {
  for (std::uint32_t seed = 300; seed < 310; ++seed) {
    const MapProfile small = ProfileOf(seed);
    MapProfile large = small;
    large.tile_cells = 32;
    const auto keyframes = RandomDrives(small, seed);
    const Tile whole = FuseTile({0, 0, 0}, keyframes, large);
    for (std::int32_t quadrant = 0; quadrant < 4; ++quadrant) {
      const TileId id{0, quadrant % 2, quadrant / 2};
      const Tile part = FuseTile(id, keyframes, small);
      for (std::size_t cell = 0; cell < 256; ++cell) {
        const auto x = static_cast<std::size_t>(id.x) * 16 + cell % 16;
        const auto y = static_cast<std::size_t>(id.y) * 16 + cell / 16;
        EXPECT_TRUE(std::ranges::equal(part.Layers(cell), whole.Layers(y * 32 + x)));
      }
    }
  }
}

TEST(TileFusionPropertyTest, FarAwayIsLikeHere) {
  const MapProfile profile = ProfileOf(1);
  const auto keyframes = RandomDrives(profile, 9);
  const Tile here = FuseTile({0, 0, 0}, keyframes, profile);
  for (const std::int32_t tiles : {-6'000'000, 6'000'000, 12'345}) {
    auto moved = keyframes;
    for (PlacedKeyframe& placed : moved) {
      placed.placement.x_um += 1'600'000LL * tiles;
      placed.placement.y_um -= 1'600'000LL * tiles;
    }
    Tile there = FuseTile({0, tiles, -tiles}, moved, profile);
    there.id = here.id;
    EXPECT_EQ(there, here) << tiles;
  }
}

// Where doubles are sure which local cell holds a map cell's centre, integers agree.
TEST(TileFusionPropertyTest, ResamplingAgreesWithDoubles) {
  const MapProfile profile = ProfileOf(2);
  std::mt19937 random(10);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  int compared = 0;
  for (int i = 0; i < 40; ++i) {
    const double yaw_deg = 180.0 * unit(random);
    const testing::MapPose pose{0.8 + unit(random), 0.8 + unit(random), 3.0 * unit(random),
                                yaw_deg};
    const std::vector<PlacedKeyframe> placed = {testing::PlacedFrame(
        {}, pose, testing::RandomKeyframe(profile, 20, static_cast<std::uint32_t>(i)))};
    const Keyframe& keyframe = *placed[0].keyframe;
    const Tile tile = FuseTile({0, 0, 0}, placed, profile);
    const double c = std::cos(yaw_deg * 3.14159265358979323846 / 180.0);
    const double s = std::sin(yaw_deg * 3.14159265358979323846 / 180.0);
    for (std::size_t cell = 0; cell < 256; ++cell) {
      const double dx = 0.1 * (static_cast<double>(cell % 16) + 0.5) - pose.x_m;
      const double dy = 0.1 * (static_cast<double>(cell / 16) + 0.5) - pose.y_m;
      const double u = (c * dx + s * dy) / 0.1;
      const double v = (c * dy - s * dx) / 0.1;
      const bool is_sure = std::abs(u - std::round(u)) > 1e-4 && std::abs(v - std::round(v)) > 1e-4;
      if (!is_sure || std::abs(std::hypot(u, v) - 20.0) < 1e-3) {
        continue;
      }
      ++compared;
      const auto ix = static_cast<std::int32_t>(std::floor(u));
      const auto iy = static_cast<std::int32_t>(std::floor(v));
      const bool is_seen =
          std::hypot(u, v) < 20.0 &&
          keyframe.cells[keyframe.grid.Index(ix, iy)].source != AltitudeSource::kNone;
      ASSERT_EQ(tile.Layers(cell).size(), is_seen ? 1u : 0u);
      if (is_seen) {
        const double z_mm =
            1e3 * pose.z_m + keyframe.cells[keyframe.grid.Index(ix, iy)].altitude_mm;
        EXPECT_NEAR(tile.Layers(cell)[0].altitude_mm, z_mm, 0.502);
      }
    }
  }
  EXPECT_GT(compared, 9'000);
}

TEST(TileFusionPropertyTest, AResidualTiltMovesAltitudesOnly) {
  const MapProfile profile = ProfileOf(3);
  Keyframe keyframe = testing::BlankKeyframe(profile, 20);
  testing::FillDisc(keyframe, {-1'000, Occupancy::kFree, AltitudeSource::kMeasured});
  auto placed = testing::PlacedFrame({}, {0.8, 0.8, 1.0, 30.0}, std::move(keyframe));
  const double slope = std::tan(1.5 * 3.14159265358979323846 / 180.0);
  placed.placement.slope_x = static_cast<std::int32_t>(std::lround(slope * (1 << 30)));
  const Tile tile = FuseTile({0, 0, 0}, std::span(&placed, 1), profile);
  const double c = std::cos(3.14159265358979323846 / 6.0);
  for (std::size_t cell = 0; cell < 256; ++cell) {
    const double dx = 0.1 * (static_cast<double>(cell % 16) + 0.5) - 0.8;
    const double dy = 0.1 * (static_cast<double>(cell / 16) + 0.5) - 0.8;
    ASSERT_EQ(tile.Layers(cell).size(), 1u);
    // The tilt is that of the local cell's centre, up to 0.07 m from the map cell's.
    EXPECT_NEAR(tile.Layers(cell)[0].altitude_mm, 1e3 * slope * (c * dx + 0.5 * dy), 2.5);
  }
}

}  // namespace
}  // namespace atlas
