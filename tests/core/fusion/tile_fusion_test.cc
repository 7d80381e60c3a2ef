// Tiny worlds: what fusion makes of a handful of keyframes whose answer is known.
#include "core/fusion/tile_fusion.h"

#include <functional>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "core/fusion/cell_layers.h"
#include "core/fusion/sigma_table.h"
#include "core/geometry/nibble.h"
#include "tests/core/support/keyframe_worlds.h"

namespace atlas {
namespace {

using testing::BlankKeyframe;
using testing::FillDisc;
using testing::PlacedFrame;

MapProfile SmallProfile() {
  MapProfile profile;
  profile.tile_cells = 16;
  return profile;
}

// A flat deck around a sensor 2 m above it.
struct Deck {
  double z_m = 0.0;  // of the deck
  Occupancy occupancy = Occupancy::kFree;
  AltitudeSource source = AltitudeSource::kMeasured;
  std::uint64_t column = 0;  // from the segment of the deck upwards: anchor -2
  double x_m = 0.8;          // of the sensor; the tile covers 0 .. 1.6 m
  double y_m = 0.8;
  std::int32_t radius_cells = 16;
};

PlacedKeyframe See(const Deck& deck, const testing::FrameName& name) {
  Keyframe keyframe = BlankKeyframe(SmallProfile(), deck.radius_cells);
  FillDisc(keyframe, {-2'000, deck.occupancy, deck.source}, deck.column);
  keyframe.anchors.assign(keyframe.anchors.size(), -2);
  return PlacedFrame(name, {deck.x_m, deck.y_m, deck.z_m + 2.0}, std::move(keyframe));
}

Tile Fuse(const std::vector<PlacedKeyframe>& keyframes) {
  return FuseTile({0, 0, 0}, keyframes, SmallProfile());
}

// The layers of the cell at the tile's middle.
std::vector<TileLayer> Middle(const std::vector<PlacedKeyframe>& keyframes) {
  const Tile tile = Fuse(keyframes);
  const auto layers = tile.Layers(8 * 16 + 8);
  return {layers.begin(), layers.end()};
}

TEST(TileFusionTest, NothingSeenIsAnEmptyTile) {
  EXPECT_TRUE(Fuse({}).is_empty());
  const auto blank = PlacedFrame({}, {0.8, 0.8}, BlankKeyframe(SmallProfile(), 16));
  const Tile tile = Fuse({blank});
  EXPECT_TRUE(tile.is_empty());
  EXPECT_TRUE(tile.contributors.empty());
}

TEST(TileFusionTest, OneKeyframeIsPublishedAsItIs) {
  const auto layers = Middle({See({.z_m = 1.5}, {})});
  ASSERT_EQ(layers.size(), 1u);
  EXPECT_EQ(layers[0].altitude_mm, 1'500);
  EXPECT_NEAR(layers[0].sigma_100um, 1'000, 10);  // 0.1 m below the sensor
  EXPECT_EQ(layers[0].occupancy, SmallProfile().miss_units);
  EXPECT_EQ(layers[0].flags,
            TileLayer::kTraversable | TileLayer::kTraversableAny | TileLayer::kMeasured);
  EXPECT_EQ(layers[0].observations, 1);
  EXPECT_EQ(layers[0].column, 0u);
}

// Rows from the top (largest y) down; '.' free, '#' obstacle, ' ' not seen.
Keyframe Draw(const std::vector<std::string_view>& rows) {
  Keyframe keyframe = BlankKeyframe(SmallProfile(), 8);
  const auto half = static_cast<std::int32_t>(rows.size() / 2);
  for (std::int32_t row = 0; row < 2 * half; ++row) {
    for (std::int32_t column = 0; column < 2 * half; ++column) {
      const char c = rows[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)];
      if (c != ' ') {
        keyframe.cells[keyframe.grid.Index(column - half, half - 1 - row)] = {
            -2'000, c == '#' ? Occupancy::kObstacle : Occupancy::kFree, AltitudeSource::kMeasured};
      }
    }
  }
  return keyframe;
}

std::vector<std::string> DrawTile(const Tile& tile) {
  std::vector<std::string> rows;
  for (std::size_t y = 12; y-- > 4;) {
    std::string row;
    for (std::size_t x = 4; x < 12; ++x) {
      const auto layers = tile.Layers(y * 16 + x);
      row += layers.empty() ? ' ' : layers[0].is_traversable() ? '.' : '#';
    }
    rows.push_back(row);
  }
  return rows;
}

TEST(TileFusionTest, ADrawnWorldLandsWhereThePoseSays) {
  const std::vector<std::string_view> world = {"  ....  ",  //
                                               " ##.... ",  //
                                               "..#.....",  //
                                               "........",  //
                                               "........",  //
                                               "......#.",  //
                                               " ....#. ",  //
                                               "  ....  "};
  const auto at = [&](double yaw_deg) {
    return DrawTile(Fuse({PlacedFrame({}, {0.8, 0.8, 2.0, yaw_deg}, Draw(world))}));
  };
  EXPECT_EQ(at(0.0), std::vector<std::string>(world.begin(), world.end()));
  EXPECT_EQ(at(90.0), (std::vector<std::string>{"  ....  ",  //
                                                " ...... ",  //
                                                "......#.",  //
                                                ".....#..",  //
                                                "........",  //
                                                ".##.....",  //
                                                " #..... ",  //
                                                "  ....  "}));
  EXPECT_EQ(at(180.0), (std::vector<std::string>{"  ....  ",  //
                                                 " .#.... ",  //
                                                 ".#......",  //
                                                 "........",  //
                                                 "........",  //
                                                 ".....#..",  //
                                                 " ....## ",  //
                                                 "  ....  "}));
}

TEST(TileFusionTest, TwoDecksAreTwoLayers) {
  const auto layers =
      Middle({See({.z_m = 0.0}, {"car", "a", 1}), See({.z_m = 5.5}, {"car", "a", 100}),
              See({.z_m = 0.02}, {"car", "b", 1})});
  ASSERT_EQ(layers.size(), 2u);
  EXPECT_EQ(layers[0].altitude_mm, 10);
  EXPECT_EQ(layers[0].observations, 2);
  EXPECT_EQ(layers[1].altitude_mm, 5'500);
}

TEST(TileFusionTest, DecksThreeMetresApartSeenFromTenMetresAreTwoLayers) {
  const auto layers =
      Middle({See({.z_m = 0.0, .x_m = 10.8, .radius_cells = 128}, {"car", "a", 1}),
              See({.z_m = 3.0, .x_m = 10.8, .radius_cells = 128}, {"car", "b", 1})});
  ASSERT_EQ(layers.size(), 2u);
  EXPECT_EQ(layers[0].altitude_mm, 0);
  EXPECT_EQ(layers[1].altitude_mm, 3'000);
  EXPECT_NEAR(layers[0].sigma_100um, 9'749, 100);  // tan 5 deg * 10 m + 0.1 m
}

TEST(TileFusionTest, TenCentimetresAreOneLayer) {
  const auto layers =
      Middle({See({.z_m = 0.0}, {"car", "a", 1}), See({.z_m = 0.1}, {"car", "b", 1})});
  ASSERT_EQ(layers.size(), 1u);
  EXPECT_EQ(layers[0].altitude_mm, 50);
}

TEST(TileFusionTest, ASecondFloorWithinOneSegmentIsFound) {
  // Consecutive keyframes jump by a deck: the run is cut, eq. 2 labels by altitude.
  std::vector<PlacedKeyframe> keyframes;
  for (std::uint32_t i = 0; i < 6; ++i) {
    keyframes.push_back(See({.z_m = i < 3 ? 0.0 : 5.5}, {"car", "a", i}));
  }
  const auto layers = Middle(keyframes);
  ASSERT_EQ(layers.size(), 2u);
  EXPECT_EQ(layers[0].observations, 3);
  EXPECT_EQ(layers[1].observations, 3);
}

TEST(TileFusionTest, AltitudesAverageByInformation) {
  // Below the sensor sigma is 0.1 m, at 1.143 m it is 0.2 m: weights 4 to 1.
  const auto layers =
      Middle({See({.z_m = 0.0, .x_m = 0.85, .y_m = 0.85}, {"car", "a", 1}),
              See({.z_m = 0.1, .x_m = 0.85 + 1.143, .y_m = 0.85}, {"car", "b", 1})});
  ASSERT_EQ(layers.size(), 1u);
  EXPECT_NEAR(layers[0].altitude_mm, 20, 1);
  EXPECT_NEAR(layers[0].sigma_100um, 894, 12);  // 1 / sqrt(100 + 25)
}

TEST(TileFusionTest, OneVehicleDoesNotOutweighTheOthers) {
  std::vector<PlacedKeyframe> keyframes;
  for (std::uint32_t i = 0; i < 256; ++i) {
    keyframes.push_back(See({.z_m = 0.3, .x_m = 0.85, .y_m = 0.85}, {"loud", "a", i}));
  }
  for (std::uint32_t i = 0; i < 64; ++i) {
    keyframes.push_back(See({.z_m = 0.0, .x_m = 0.85, .y_m = 0.85}, {"quiet", "a", i}));
  }
  const auto layers = Middle(keyframes);
  ASSERT_EQ(layers.size(), 1u);
  EXPECT_NEAR(layers[0].altitude_mm, 150, 3);
  EXPECT_EQ(layers[0].observations, 320);
}

TEST(TileFusionTest, GuessedAltitudesMakeNoLayerWhereGroundWasMeasured) {
  const auto guess =
      See({.z_m = 0.4, .occupancy = Occupancy::kObstacle, .source = AltitudeSource::kExtrapolated},
          {"car", "a", 1});
  const auto far_guess =
      See({.z_m = 7.0, .source = AltitudeSource::kExtrapolated}, {"car", "b", 1});
  const auto measured = See({.z_m = 0.0}, {"car", "c", 1});

  const auto alone = Middle({guess});
  ASSERT_EQ(alone.size(), 1u);
  EXPECT_EQ(alone[0].altitude_mm, 400);
  EXPECT_EQ(alone[0].flags & TileLayer::kMeasured, 0);

  const Tile tile = Fuse({guess, far_guess, measured});
  const auto layers = tile.Layers(8 * 16 + 8);
  ASSERT_EQ(layers.size(), 1u);
  EXPECT_EQ(layers[0].altitude_mm, 0);  // the near guess says nothing about the altitude
  EXPECT_EQ(layers[0].observations, 2);
  EXPECT_EQ(layers[0].occupancy, SmallProfile().hit_units + SmallProfile().miss_units);
  EXPECT_EQ(tile.contributors, (std::vector<SessionKey>{{"car", "a"}, {"car", "c"}}));
}

TEST(TileFusionTest, AMovingObjectIsGoneAfterMisses) {
  std::vector<PlacedKeyframe> keyframes;
  std::uint32_t sequence = 0;
  const auto pass = [&](int count, Occupancy occupancy, std::uint64_t column) {
    for (int i = 0; i < count; ++i) {
      const testing::FrameName name{"car", "a", sequence++};
      keyframes.push_back(See({.occupancy = occupancy, .column = column}, name));
    }
  };
  // However long it stood: evidence saturates, so that a bounded number of misses removes it.
  pass(50, Occupancy::kObstacle, 0x000000CC);
  ASSERT_FALSE(Middle(keyframes)[0].is_traversable());
  EXPECT_EQ(Middle(keyframes)[0].column & 15, 15u);
  pass(6, Occupancy::kFree, 0x00000066);
  const TileLayer layer = Middle(keyframes)[0];
  EXPECT_TRUE(layer.is_traversable());
  EXPECT_LT(layer.column & 15, kNibbleUnknown);
}

TEST(TileFusionTest, SessionsFoldInTheOrderOfTheirLastObservation) {
  // Full evidence for, then full evidence against: neutral. The other way round as well, but three
  // sessions for, saturating, then one against leaves nothing of the three.
  const auto session = [](const char* name, std::uint32_t first, Occupancy occupancy) {
    std::vector<PlacedKeyframe> keyframes;
    for (std::uint32_t i = 0; i < 20; ++i) {
      keyframes.push_back(See({.occupancy = occupancy}, {"car", name, first + i}));
    }
    return keyframes;
  };
  const auto occupancy_of = [&](std::uint32_t time_of_misses) {
    std::vector<PlacedKeyframe> all;
    for (const auto& part :
         {session("x", 0, Occupancy::kObstacle), session("y", 100, Occupancy::kObstacle),
          session("a", time_of_misses, Occupancy::kFree)}) {
      all.insert(all.end(), part.begin(), part.end());
    }
    return Middle(all)[0].occupancy;
  };
  EXPECT_EQ(occupancy_of(200), 0);  // 64, 64 (clamped), 0
  EXPECT_EQ(occupancy_of(50), 64);  // 64, 0, 64
}

TEST(TileFusionTest, EvidenceFoldsByTimeNotBySequence) {
  // Hits saturate at +64 in four; one miss before or after them differs.
  const auto occupancy_with_miss_at = [](std::int64_t time_ms) {
    std::vector<PlacedKeyframe> keyframes;
    for (std::uint32_t i = 0; i < 4; ++i) {
      keyframes.push_back(See({.occupancy = Occupancy::kObstacle}, {"car", "a", i}));
    }
    keyframes.push_back(See({.occupancy = Occupancy::kFree}, {"car", "a", 9}));
    keyframes.back().time_ms = time_ms;
    return Middle(keyframes)[0].occupancy;
  };
  EXPECT_EQ(occupancy_with_miss_at(1'000), 64 - 12);
  EXPECT_EQ(occupancy_with_miss_at(-1), 64);
}

TEST(TileFusionTest, ColumnsStandOnTheWorldsLattice) {
  // Deck at 0.2 m, base offset 0.3 m: the base segment is [0, 1) m. The sensor is at 2.2 m, whose
  // nearest lattice index is 2, so that the keyframe's segments start at index 0.
  const auto layers = Middle({See({.z_m = 0.2, .column = 0x000006C0}, {})});
  EXPECT_EQ(layers[0].column, 0x00000'6C0u);
  // The deck at 0.8 m stands in segment [1, 2) m; the sensor at 2.8 m is nearest to index 3.
  EXPECT_EQ(Middle({See({.z_m = 0.8, .column = 0x000006C0}, {})})[0].column, 0x00000'6C0u);
  // At 0.6 m the sensor's index rounds up to 3 while the deck still stands in [0, 1) m.
  EXPECT_EQ(Middle({See({.z_m = 0.6, .column = 0x000006C0}, {})})[0].column, 0x00006C00u);
}

TEST(TileFusionTest, ColumnsNeverCrossTheNextDeck) {
  const std::uint64_t full = 0xCCCCCCCC;
  const auto alone = Middle({See({.z_m = 0.0, .column = full}, {"car", "a", 1})});
  EXPECT_EQ(alone[0].column, full);
  const auto layers = Middle({See({.z_m = 0.0, .column = full}, {"car", "a", 1}),
                              See({.z_m = 5.5, .column = full}, {"car", "b", 1})});
  ASSERT_EQ(layers.size(), 2u);
  // 5.5 m - 0.7 m slab: segments 0..3 of 1 m.
  EXPECT_EQ(layers[0].column, 0x0000CCCCu);
  // Deck at 5.5 m: the sensor's 7.5 m round to 8, so that its segments start at 6; base is 5.
  EXPECT_EQ(layers[1].column, 0xCCCCCCC0u);
}

TEST(TileFusionTest, ACellHoldsABoundedNumberOfLayers) {
  std::vector<PlacedKeyframe> keyframes;
  for (std::uint32_t deck = 0; deck < 40; ++deck) {
    const int passes = deck % 2 == 0 ? 2 : 1;
    for (int pass = 0; pass < passes; ++pass) {
      const std::string session = "s" + std::to_string(pass);
      keyframes.push_back(See({.z_m = 5.0 * deck}, {"car", session, 10 * deck}));
    }
  }
  const auto layers = Middle(keyframes);
  ASSERT_EQ(layers.size(), kMaxCellLayers);
  for (std::size_t i = 0; i < layers.size(); ++i) {
    EXPECT_EQ(layers[i].altitude_mm, static_cast<std::int32_t>(10'000 * i));  // seen twice
    EXPECT_EQ(layers[i].observations, 2);
  }
}

TEST(TileFusionTest, PaperPresetJoinsWhatTheGatesKeepApart) {
  MapProfile paper = SmallProfile();
  paper.preset = FusionPreset::kPaper;
  const std::vector<PlacedKeyframe> keyframes = {
      See({.z_m = 0.0, .x_m = 10.8, .radius_cells = 128}, {"car", "a", 1}),
      See({.z_m = 3.0, .x_m = 10.8, .radius_cells = 128}, {"car", "b", 1})};
  const Tile tile = FuseTile({0, 0, 0}, keyframes, paper);
  ASSERT_EQ(tile.Layers(8 * 16 + 8).size(), 1u);
  EXPECT_EQ(tile.Layers(8 * 16 + 8)[0].altitude_mm, 1'500);
}

TEST(SigmaTableTest, FollowsThePapersFormula) {
  const MapProfile profile;
  const SigmaTable table(profile, 300);
  for (std::size_t d2 = 0; d2 < 90'000; d2 += 7) {
    const double d_m = 0.1 * std::sqrt(static_cast<double>(d2) + 0.5);
    const std::uint16_t step = table.Step(d2);
    const double sigma_m = 0.087489 * d_m + 0.1;
    EXPECT_NEAR(table.Sigma_100um(AltitudeSource::kMeasured, step) * 1e-4, sigma_m, 7e-4);
    EXPECT_NEAR(table.Sigma_100um(AltitudeSource::kInterpolated, step) * 1e-4, sigma_m + 0.05,
                7e-4);
    EXPECT_NEAR(table.Sigma_100um(AltitudeSource::kExtrapolated, step) * 1e-4, sigma_m + 0.3, 7e-4);
    const double weight = kUnitWeight * 0.01 / (sigma_m * sigma_m);
    EXPECT_NEAR(table.Weight(AltitudeSource::kMeasured, step), weight, 0.015 * weight + 1);
  }
  EXPECT_EQ(table.SigmaOfWeight_100um(kUnitWeight), 1'000);
  EXPECT_EQ(table.SigmaOfWeight_100um(4 * kUnitWeight), 500);
  EXPECT_EQ(table.SigmaOfWeight_100um(1), 65'535);
}

}  // namespace
}  // namespace atlas
