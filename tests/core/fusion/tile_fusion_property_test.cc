// What must hold for any keyframes: order does not matter, tile borders do not show, far away is
// like here, resampling agrees with doubles, and the product equals the plain fusion.
#include <algorithm>
#include <cmath>
#include <ios>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "core/base/str_cat.h"
#include "core/fusion/survey/fusion_stretch.h"
#include "core/fusion/tile_fusion.h"
#include "core/tile/tile_codec.h"
#include "tests/core/fusion/oracle/plain_fusion.h"
#include "tests/core/fusion/random_drives.h"
#include "tests/core/support/keyframe_worlds.h"
#include "tests/core/support/test_scale.h"

namespace atlas {
namespace {

using testing::DrivesProfile;
using testing::RandomDrives;

constexpr double kPi = 3.14159265358979323846;

// The first difference between two tiles, or nothing.
std::string Difference(const Tile& tile, const Tile& expected) {
  if (tile.contributors != expected.contributors) {
    return "contributors";
  }
  if (tile.cell_begin != expected.cell_begin) {
    return "layer counts";
  }
  for (std::size_t i = 0; i < tile.layers.size(); ++i) {
    const TileLayer& a = tile.layers[i];
    const TileLayer& b = expected.layers[i];
    if (!(a == b)) {
      return StrCat("layer ", i, ": altitude ", a.altitude_mm, " ", b.altitude_mm, ", sigma ",
                    a.sigma_100um, " ", b.sigma_100um, ", occupancy ", int{a.occupancy}, " ",
                    int{b.occupancy}, ", column ", std::hex, a.column, " ", b.column);
    }
  }
  return {};
}

std::size_t UpperLayers(const Tile& tile) {
  std::size_t count = 0;
  for (std::size_t cell = 0; cell + 1 < tile.cell_begin.size(); ++cell) {
    count += std::max<std::size_t>(tile.Layers(cell).size(), 1) - 1;
  }
  return count;
}

TEST(TileFusionPropertyTest, EqualsThePlainFusion) {
  std::size_t upper_layers = 0;
  std::ptrdiff_t columns = 0;
  for (std::uint32_t seed = 0; seed < testing::Scaled(60); ++seed) {
    MapProfile profile = DrivesProfile(seed);
    if (seed % 5 == 3) {
      profile.preset = FusionPreset::kPaper;
      profile.sequence_gap = static_cast<std::uint16_t>(1 + seed % 3);
    }
    const auto keyframes = RandomDrives(profile, seed);
    const TileId id{0, seed % 5 == 0 ? -1 : 0, 0};
    const Tile tile = FuseTile(id, keyframes, profile);
    ASSERT_EQ(Difference(tile, testing::PlainFuseTile(id, keyframes, profile)), "")
        << "seed " << seed;
    upper_layers += UpperLayers(tile);
    columns += std::count_if(tile.layers.begin(), tile.layers.end(),
                             [](const TileLayer& layer) { return layer.column != 0; });
  }
  EXPECT_GT(upper_layers, 80 * testing::Scaled(60));  // as hard as they are meant to be
  EXPECT_GT(columns, 80 * testing::Scaled(60));
}

TEST(TileFusionPropertyTest, TheOrderOfKeyframesDoesNotMatter) {
  for (std::uint32_t seed = 100; seed < 100 + testing::Scaled(30); ++seed) {
    const MapProfile profile = DrivesProfile(seed);
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
  for (std::uint32_t seed = 200; seed < 200 + testing::Scaled(30); ++seed) {
    const MapProfile profile = DrivesProfile(seed);
    const Tile tile = FuseTile({0, 0, 0}, RandomDrives(profile, seed), profile);
    const auto decoded = DecodeTile(EncodeTile(tile, profile).blob, profile);
    ASSERT_TRUE(decoded.has_value()) << decoded.error().message();
    EXPECT_EQ(*decoded, tile);
    EXPECT_EQ(tile.is_empty(), tile.contributors.empty());
  }
}

// The cell's layers from one altitude up to another.
std::vector<TileLayer> LayersBetween(const Tile& tile, std::size_t cell, int from_mm, int to_mm) {
  std::vector<TileLayer> found;
  for (const TileLayer& layer : tile.Layers(cell)) {
    if (from_mm <= layer.altitude_mm && layer.altitude_mm < to_mm) {
      found.push_back(layer);
    }
  }
  return found;
}

TEST(TileFusionPropertyTest, OneDeckNeverTouchesAnother) {
  constexpr int kAbove_mm = 60'000;
  constexpr int kBetween_mm = 40'000;
  constexpr int kSky_mm = 1'000'000;
  std::size_t both = 0;
  for (std::uint32_t seed = 400; seed < 400 + testing::Scaled(40); ++seed) {
    const MapProfile profile = DrivesProfile(seed);
    const auto below = RandomDrives(profile, seed);
    auto above = RandomDrives(profile, seed + 10'000);
    for (PlacedKeyframe& keyframe : above) {
      keyframe.key.session.session += "-above";
      keyframe.placement.z_um += 1'000 * kAbove_mm;
    }
    auto all = below;
    all.insert(all.end(), above.begin(), above.end());
    const Tile tile = FuseTile({0, 0, 0}, all, profile);
    const Tile lower = FuseTile({0, 0, 0}, below, profile);
    const Tile upper = FuseTile({0, 0, 0}, above, profile);
    for (std::size_t cell = 0; cell + 1 < tile.cell_begin.size(); ++cell) {
      if (tile.Layers(cell).size() == kMaxCellLayers) {
        continue;
      }
      const auto lower_layers = LayersBetween(lower, cell, -kSky_mm, kSky_mm);
      const auto upper_layers = LayersBetween(upper, cell, -kSky_mm, kSky_mm);
      ASSERT_EQ(LayersBetween(tile, cell, -kSky_mm, kBetween_mm), lower_layers) << "seed " << seed;
      ASSERT_EQ(LayersBetween(tile, cell, kBetween_mm, kSky_mm), upper_layers) << "seed " << seed;
      both += !lower_layers.empty() && !upper_layers.empty() ? 1U : 0U;
    }
  }
  EXPECT_GT(both, 50 * testing::Scaled(40));
}

TEST(TileFusionPropertyTest, KeyframesThatDoNotReachTheTileAreIgnored) {
  const MapProfile profile = DrivesProfile(0);
  auto keyframes = RandomDrives(profile, 7);
  const Tile tile = FuseTile({0, 0, 0}, keyframes, profile);
  for (const double x_m : {-3.0, 4.2, 9e6, -9e6}) {
    keyframes.push_back(testing::PlacedFrame({"car0", "s0", 900}, {x_m, 0.8},
                                             testing::RandomKeyframe(profile, 16, 1)));
  }
  EXPECT_EQ(FuseTile({0, 0, 0}, keyframes, profile), tile);
}

TEST(TileFusionPropertyTest, AKeyframeReachesNoTileBeyondItsFootprint) {
  const MapProfile profile = DrivesProfile(0);
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
  for (std::uint32_t seed = 300; seed < 300 + testing::Scaled(10); ++seed) {
    const MapProfile small = DrivesProfile(seed);
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
  const MapProfile profile = DrivesProfile(1);
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

// The centre of a cell of tile 0/0/0, metres.
Eigen::Vector2d CellCentre(std::size_t cell) {
  const std::size_t x = cell % 16;
  const std::size_t y = cell / 16;
  return {0.1 * (static_cast<double>(x) + 0.5), 0.1 * (static_cast<double>(y) + 0.5)};
}

// A map cell's centre in local cells, by doubles.
Eigen::Vector2d ToLocalCells(const testing::MapPose& pose, std::size_t cell) {
  const Eigen::Vector2d offset = CellCentre(cell) - Eigen::Vector2d(pose.x_m, pose.y_m);
  return Eigen::Rotation2Dd(-pose.yaw_deg * kPi / 180.0) * offset / 0.1;
}

// Too near to a border between local cells, or of the disc, for doubles to be sure.
bool IsDoubtful(const Eigen::Vector2d& local, double radius_cells) {
  const Eigen::Vector2d rest = local - local.array().round().matrix();
  return rest.cwiseAbs().minCoeff() < 1e-4 || std::abs(local.norm() - radius_cells) < 1e-3;
}

// The altitude that `keyframe` gives to a point, in the world; nothing where it saw nothing.
std::optional<double> AltitudeByDoubles(const Keyframe& keyframe,
                                        const testing::MapPose& pose,
                                        const Eigen::Vector2d& local) {
  if (local.norm() >= keyframe.grid.radius_cells) {
    return std::nullopt;
  }
  const auto ix = static_cast<std::int32_t>(std::floor(local.x()));
  const auto iy = static_cast<std::int32_t>(std::floor(local.y()));
  const KeyframeCell& cell = keyframe.cells[keyframe.grid.Index(ix, iy)];
  return cell.source == AltitudeSource::kNone ? std::nullopt
                                              : std::optional(1e3 * pose.z_m + cell.altitude_mm);
}

// Whether a cell of one keyframe's tile holds that altitude, or nothing.
bool Agrees(std::span<const TileLayer> layers, const std::optional<double>& altitude_mm) {
  if (!altitude_mm) {
    return layers.empty();
  }
  return layers.size() == 1 && std::abs(layers[0].altitude_mm - *altitude_mm) < 0.502;
}

TEST(TileFusionPropertyTest, ResamplingAgreesWithDoubles) {
  const MapProfile profile = DrivesProfile(2);
  std::mt19937 random(10);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  int compared = 0;
  for (std::uint32_t i = 0; i < 40; ++i) {
    const testing::MapPose pose{0.8 + unit(random), 0.8 + unit(random), 3.0 * unit(random),
                                180.0 * unit(random)};
    Keyframe keyframe = testing::RandomKeyframe(profile, 20, i);
    for (KeyframeCell& cell : keyframe.cells) {  // a guess makes no layer where it is free
      cell.source = cell.source == AltitudeSource::kExtrapolated ? AltitudeSource::kInterpolated
                                                                 : cell.source;
    }
    const PlacedKeyframe placed = testing::PlacedFrame({}, pose, std::move(keyframe));
    const Tile tile = FuseTile({0, 0, 0}, std::span(&placed, 1), profile);
    for (std::size_t cell = 0; cell < 256; ++cell) {
      const Eigen::Vector2d local = ToLocalCells(pose, cell);
      if (IsDoubtful(local, 20.0)) {
        continue;
      }
      ++compared;
      EXPECT_TRUE(Agrees(tile.Layers(cell), AltitudeByDoubles(*placed.keyframe, pose, local)))
          << "keyframe " << i << ", cell " << cell;
    }
  }
  EXPECT_GT(compared, 9'000);
}

TEST(TileFusionPropertyTest, AResidualTiltMovesAltitudesOnly) {
  const MapProfile profile = DrivesProfile(3);
  Keyframe keyframe = testing::BlankKeyframe(profile, 20);
  testing::FillDisc(keyframe, {-1'000, Occupancy::kFree, AltitudeSource::kMeasured});
  auto placed = testing::PlacedFrame({}, {0.8, 0.8, 1.0, 30.0}, std::move(keyframe));
  const double slope = std::tan(1.5 * kPi / 180.0);
  placed.placement.slope_x = static_cast<std::int32_t>(std::lround(slope * (1 << 30)));
  const Tile tile = FuseTile({0, 0, 0}, std::span(&placed, 1), profile);
  const double c = std::cos(kPi / 6.0);
  for (std::size_t cell = 0; cell < 256; ++cell) {
    const Eigen::Vector2d offset = CellCentre(cell) - Eigen::Vector2d(0.8, 0.8);
    ASSERT_EQ(tile.Layers(cell).size(), 1u);
    // The tilt is that of the local cell's centre, up to 0.07 m from the map cell's.
    EXPECT_NEAR(tile.Layers(cell)[0].altitude_mm, 1e3 * slope * (c * offset.x() + 0.5 * offset.y()),
                2.5);
  }
}

TEST(TileFusionPropertyTest, BandsOfATileAreTheTile) {
  for (std::uint32_t seed = 400; seed < 400 + testing::Scaled(10); ++seed) {
    MapProfile profile = DrivesProfile(0);
    profile.tile_cells = 64;
    const auto keyframes = RandomDrives(profile, seed);
    std::vector<FrameOnMap> frames;
    for (const PlacedKeyframe& k : keyframes) {
      frames.push_back({k.key, k.time_ms, k.placement, k.keyframe->grid});
    }
    std::weak_ptr<const Keyframe> last;
    int loads = 0;
    const auto source = [&](std::size_t i) -> Result<std::shared_ptr<const Keyframe>> {
      EXPECT_TRUE(last.expired()) << "two keyframes are held at a time";
      auto copy = std::make_shared<const Keyframe>(*keyframes[i].keyframe);
      last = copy;
      ++loads;
      return copy;
    };
    const auto loads_of = [&](std::size_t max_bytes) {
      const int before = loads;
      const auto tile = FuseTile({0, 0, 0}, frames, source, profile, max_bytes);
      EXPECT_EQ(tile.value(), FuseTile({0, 0, 0}, keyframes, profile)) << "seed " << seed;
      return loads - before;
    };
    const int count = static_cast<int>(frames.size());
    const int loads_of_one_band = loads_of(std::size_t{128} << 20);
    EXPECT_LE(loads_of_one_band, count);

    const std::size_t row_bytes = CutStretches({0, 0, 0}, frames, profile).size() * 128 * 64;
    const int loads_of_16_rows = loads_of(16 * row_bytes);
    EXPECT_GT(loads_of_16_rows, loads_of_one_band) << "that is enough for a fourth of the tile";
    EXPECT_LE(loads_of_16_rows, 4 * count);

    const int loads_of_a_row = loads_of(1);
    EXPECT_GT(loads_of_a_row, loads_of_16_rows) << "a byte is enough for no more than a row";
    EXPECT_LE(loads_of_a_row, profile.tile_cells * count);
  }
}

TEST(TileFusionPropertyTest, ASourcesErrorIsTheTiles) {
  const MapProfile profile = DrivesProfile(0);
  const auto keyframes = RandomDrives(profile, 9);
  const FrameOnMap frame{keyframes[0].key, 0, keyframes[0].placement, keyframes[0].keyframe->grid};
  const auto failing = [](std::size_t) -> Result<std::shared_ptr<const Keyframe>> {
    return Error(StatusCode::kInvalidData, "damaged");
  };
  const auto tile = FuseTile({0, 0, 0}, std::span(&frame, 1), failing, profile);
  ASSERT_FALSE(tile.has_value());
  EXPECT_EQ(tile.error().code(), StatusCode::kInvalidData);
}

}  // namespace
}  // namespace atlas
