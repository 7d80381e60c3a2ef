// Tiny worlds: the layers that fusion makes of a handful of keyframes whose answer is known.
#include "core/fusion/tile_fusion.h"

#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/str_cat.h"
#include "tests/core/fusion/deck_world.h"

namespace atlas {
namespace {

using testing::BlankKeyframe;
using testing::Fuse;
using testing::Middle;
using testing::PlacedFrame;
using testing::See;
using testing::SmallProfile;

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
  EXPECT_NEAR(layers[0].sigma_100um, 1'062, 32);  // tan 5 deg * 0.07 m + 0.1 m, rounded
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
                                                " ....#. ",  //
                                                "......#.",  //
                                                "........",  //
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
  EXPECT_NEAR(layers[0].sigma_100um, 9'749, 256);  // tan 5 deg * 10 m + 0.1 m
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
  // The cell's centre is 0.0707 m from one sensor (sigma 0.1062 m) and 1.2844 m from the other
  // (twice as much): weights 4 to 1.
  const auto layers = Middle({See({.z_m = 0.0}, {"car", "a", 1}),
                              See({.z_m = 0.1, .x_m = 0.85 + 1.2834}, {"car", "b", 1})});
  ASSERT_EQ(layers.size(), 1u);
  EXPECT_NEAR(layers[0].altitude_mm, 20, 1);
  EXPECT_NEAR(layers[0].sigma_100um, 950, 16);  // 0.1062 / sqrt(1 + 1/4)
}

TEST(TileFusionTest, OneVehicleDoesNotOutweighTheOthers) {
  std::vector<PlacedKeyframe> keyframes;
  for (std::uint32_t i = 0; i < 256; ++i) {
    keyframes.push_back(See({.z_m = 0.3, .x_m = 0.85, .y_m = 0.85}, {"loud", "a", i}));
  }
  for (std::uint32_t i = 0; i < 80; ++i) {
    keyframes.push_back(See({.z_m = 0.0, .x_m = 0.85, .y_m = 0.85}, {"quiet", "a", i}));
  }
  const auto layers = Middle(keyframes);
  ASSERT_EQ(layers.size(), 1u);
  EXPECT_EQ(layers[0].altitude_mm, 150);  // both reach the cap
  EXPECT_EQ(layers[0].observations, 336);
}

PlacedKeyframe Guess(double z_m, Occupancy occupancy, const std::string& session = "b") {
  return See({.z_m = z_m, .occupancy = occupancy, .source = AltitudeSource::kExtrapolated},
             {"car", session, 1});
}

TEST(TileFusionTest, FreeSpaceAtAGuessedHeightIsNoSurface) {
  EXPECT_TRUE(Fuse({Guess(0.0, Occupancy::kFree)}).is_empty());
  EXPECT_TRUE(Fuse({Guess(0.0, Occupancy::kUnknown)}).is_empty());
  EXPECT_TRUE(Fuse({Guess(0.0, Occupancy::kFree)}).contributors.empty());
  const PlacedKeyframe road = See({.z_m = 0.0}, {"car", "a", 1});
  EXPECT_EQ(Middle({road, Guess(7.0, Occupancy::kFree)}), Middle({road}));
}

TEST(TileFusionTest, GuessedAltitudesLendWhatTheySayToMeasuredGround) {
  const PlacedKeyframe guess = Guess(0.4, Occupancy::kObstacle);
  const auto alone = Middle({guess});
  ASSERT_EQ(alone.size(), 1u);
  EXPECT_EQ(alone[0].altitude_mm, 400);
  EXPECT_EQ(alone[0].flags & TileLayer::kMeasured, 0);

  const Tile tile = Fuse({guess, See({.z_m = 0.0}, {"car", "c", 1})});
  const auto layers = tile.Layers(8 * 16 + 8);
  ASSERT_EQ(layers.size(), 1u);
  EXPECT_EQ(layers[0].altitude_mm, 0);  // the guess says nothing about the altitude
  EXPECT_EQ(layers[0].observations, 2);
  EXPECT_EQ(layers[0].occupancy, SmallProfile().hit_units + SmallProfile().miss_units);
  EXPECT_EQ(tile.contributors, (std::vector<SessionKey>{{"car", "b"}, {"car", "c"}}));
}

// Whether the one who guesses has a stretch of its own or shares it with the one who measured.
TEST(TileFusionTest, WhoeverSpeaksOfALayerConfirmsIt) {
  for (const std::string session : {"a", "b"}) {
    PlacedKeyframe measured = See({.z_m = 0.0}, {"car", "a", 0});
    measured.time_ms = 5'000;
    PlacedKeyframe guess = Guess(0.4, Occupancy::kFree, session);
    guess.time_ms = 9'000;
    const auto layers = Middle({measured, guess});
    ASSERT_EQ(layers.size(), 1u);
    EXPECT_EQ(layers[0].confirmed_s, 9u) << session;
  }
}

TEST(TileFusionTest, AnObstacleOnAnotherDeckStandsOnALayerOfItsOwn) {
  // A parapet on the bridge, seen from there, and the road below, measured.
  const PlacedKeyframe road = See({.z_m = 0.0}, {"car", "a", 1});
  const auto layers = Middle({road, Guess(5.5, Occupancy::kObstacle)});
  ASSERT_EQ(layers.size(), 2u);
  EXPECT_EQ(layers[0].altitude_mm, 0);
  EXPECT_EQ(layers[1].altitude_mm, 5'500);
  EXPECT_EQ(layers[1].occupancy, SmallProfile().hit_units);
  EXPECT_EQ(layers[1].flags & TileLayer::kMeasured, 0);
  // One that may stand on the road does.
  EXPECT_EQ(Middle({road, Guess(1.9, Occupancy::kObstacle)}).size(), 1u);
}

TEST(TileFusionTest, ACellHoldsABoundedNumberOfLayers) {
  std::vector<PlacedKeyframe> keyframes;
  for (std::uint32_t deck = 0; deck < 40; ++deck) {
    const int passes = deck % 2 == 0 ? 2 : 1;
    for (int pass = 0; pass < passes; ++pass) {
      const std::string session = StrCat("s", pass);
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

}  // namespace
}  // namespace atlas
