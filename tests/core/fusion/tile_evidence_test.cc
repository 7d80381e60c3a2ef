// Tiny worlds: the occupancy and columns that fusion makes of a handful of keyframes.
#include <vector>

#include <gtest/gtest.h>

#include "core/geometry/nibble.h"
#include "tests/core/fusion/deck_world.h"

namespace atlas {
namespace {

using testing::Deck;
using testing::Middle;
using testing::See;

TEST(TileEvidenceTest, AMovingObjectIsGoneAfterMisses) {
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

std::vector<PlacedKeyframe> Session(const char* name, std::uint32_t first, Occupancy occupancy) {
  std::vector<PlacedKeyframe> keyframes;
  for (std::uint32_t i = 0; i < 20; ++i) {
    keyframes.push_back(See({.occupancy = occupancy}, {"car", name, first + i}));
  }
  return keyframes;
}

std::int8_t OccupancyOf(const std::vector<std::vector<PlacedKeyframe>>& sessions) {
  std::vector<PlacedKeyframe> all;
  for (const auto& session : sessions) {
    all.insert(all.end(), session.begin(), session.end());
  }
  return Middle(all)[0].occupancy;
}

TEST(TileEvidenceTest, WhatWasSeenLastDecides) {
  // However many sessions agreed, a later one with all its say turns them: 64, then 48 carried.
  const auto x = Session("x", 0, Occupancy::kObstacle);
  const auto y = Session("y", 100, Occupancy::kObstacle);
  EXPECT_EQ(OccupancyOf({x, y}), 64);
  EXPECT_EQ(OccupancyOf({x, y, Session("a", 200, Occupancy::kFree)}), 48 - 64);
  EXPECT_EQ(OccupancyOf({x, Session("a", 50, Occupancy::kFree), y}), 48);  // 64, -16, 48
  EXPECT_EQ(OccupancyOf({x, Session("a", 50, Occupancy::kUnknown)}), 64);  // says nothing
}

TEST(TileEvidenceTest, WhereTheVehicleStoodOneCanDrive) {
  const auto occupancy_after = [](std::uint32_t hits_before, std::uint32_t hits_after) {
    std::vector<PlacedKeyframe> keyframes;
    const auto add = [&](Occupancy occupancy) {
      const auto sequence = static_cast<std::uint32_t>(keyframes.size());
      keyframes.push_back(See({.occupancy = occupancy}, {"car", "a", sequence}));
    };
    for (std::uint32_t i = 0; i < hits_before; ++i) add(Occupancy::kObstacle);
    add(Occupancy::kDriven);
    add(Occupancy::kFree);
    for (std::uint32_t i = 0; i < hits_after; ++i) add(Occupancy::kObstacle);
    return Middle(keyframes)[0].occupancy;
  };
  EXPECT_EQ(occupancy_after(50, 0), -64);  // as much as a stretch may say
  EXPECT_EQ(occupancy_after(0, 50), -64);  // whatever follows the vehicle
}

// Twenty keyframes that see an obstacle where the vehicle of session a drove at 0.1 s; the last of
// them is `seconds` later.
std::int8_t OccupancyOfFollower(const char* session, std::uint32_t seconds) {
  const PlacedKeyframe driven = See({.occupancy = Occupancy::kDriven}, {"car", "a", 1});
  const std::uint32_t last = 1 + 10 * seconds;  // 100 ms a sequence number
  return OccupancyOf({{driven}, Session(session, last - 19, Occupancy::kObstacle)});
}

TEST(TileEvidenceTest, WhatFollowsTheVehicleIsNotThereForAMinute) {
  EXPECT_EQ(OccupancyOfFollower("a", 3), -64);   // the same stretch
  EXPECT_EQ(OccupancyOfFollower("a", 60), -64);  // a later one
  EXPECT_EQ(OccupancyOfFollower("a", 61), 64 - 48);
  EXPECT_EQ(OccupancyOfFollower("b", 3), 64 - 48);  // who says that the clocks are the same?
  // Within one stretch, keyframes 10 s apart.
  const auto occupancy_after = [](std::uint32_t count) {
    std::vector<PlacedKeyframe> keyframes = {
        See({.occupancy = Occupancy::kDriven}, {"car", "a", 0})};
    for (std::uint32_t i = 1; i <= count; ++i) {
      keyframes.push_back(See({.occupancy = Occupancy::kObstacle}, {"car", "a", i}));
      keyframes.back().time_ms = keyframes.front().time_ms + 10'000 * i;
    }
    return Middle(keyframes)[0].occupancy;
  };
  EXPECT_EQ(occupancy_after(6), -64);
  EXPECT_EQ(occupancy_after(7), -64 + 25);  // it came to stay, and hits add up
  EXPECT_GT(occupancy_after(10), 0);
}

TEST(TileEvidenceTest, WhereTheVehicleWasNothingWasBefore) {
  const auto before = Session("b", 10, Occupancy::kObstacle);
  const PlacedKeyframe driven = See({.occupancy = Occupancy::kDriven}, {"car", "a", 250});
  EXPECT_EQ(OccupancyOf({before, {driven}, Session("a", 260, Occupancy::kObstacle)}), -16);
  // On another deck it says nothing of this one.
  const PlacedKeyframe above = See({.z_m = 5.0, .occupancy = Occupancy::kDriven}, {"car", "a", 1});
  EXPECT_EQ(OccupancyOf({{above}, Session("a", 260, Occupancy::kObstacle)}), 64);
}

TEST(TileEvidenceTest, ColumnsOfWhatFollowsTheVehicleAreNotThereEither) {
  // Seen by a later stretch from 0.4 m lower, so that its column begins a segment lower: at 0 m,
  // not at 1 m.
  const auto column_after = [](std::uint32_t seconds, std::uint8_t said) {
    const PlacedKeyframe car = See({.z_m = 0.8, .column = said}, {"car", "a", 1});
    PlacedKeyframe later = See({.z_m = 0.4, .column = 0xFFF}, {"car", "a", 300});
    later.time_ms = car.time_ms + 1'000 * seconds;
    const auto layers = Middle({car, later});
    EXPECT_EQ(layers.size(), 1u);
    return layers[0].column & 0xFFF;
  };
  EXPECT_EQ(column_after(1, kNibbleFree), 0xF1FU);
  EXPECT_EQ(column_after(60, kNibbleFree), 0xF1FU);
  EXPECT_EQ(column_after(61, kNibbleFree), 0xFAFU);  // 64 - 48
  EXPECT_EQ(column_after(1, kNibbleOver), 0xFAFU);   // a ceiling right above it
}

TEST(TileEvidenceTest, WhereTheVehicleWasLongAgoHitsAddUpAgain) {
  const auto column_after = [](std::uint32_t hits) {
    std::vector<PlacedKeyframe> keyframes = {
        See({.column = std::uint64_t{kNibbleOver} << 4 | kNibbleFree}, {"car", "a", 0})};
    for (std::uint32_t i = 1; i <= hits; ++i) {
      keyframes.push_back(See({.column = 0xCC}, {"car", "a", i}));
      keyframes.back().time_ms += 60'000;
    }
    return Middle(keyframes)[0].column & 0xFF;
  };
  EXPECT_EQ(column_after(1), 0x33U);  // -64 + 29
  EXPECT_EQ(column_after(3), 0xBBU);
}

TEST(TileEvidenceTest, WhatFollowsTheVehicleLeavesNothingBehind) {
  // Lower segment: the vehicle itself. Upper one: right above it, which a ceiling fills, and no
  // head.
  const auto column_after = [](std::uint32_t hits_before, std::uint32_t hits_after) {
    std::vector<PlacedKeyframe> keyframes;
    const auto add = [&](std::uint64_t column) {
      const auto sequence = static_cast<std::uint32_t>(keyframes.size());
      keyframes.push_back(See({.column = column}, {"car", "a", sequence}));
    };
    for (std::uint32_t i = 0; i < hits_before; ++i) add(0xCC);
    add(std::uint64_t{kNibbleOver} << 4 | kNibbleFree);
    add(0x66);
    for (std::uint32_t i = 0; i < hits_after; ++i) add(0xCC);
    return Middle(keyframes)[0].column;
  };
  EXPECT_EQ(column_after(50, 0) & 0xFF, 0x11U);
  EXPECT_EQ(column_after(0, 50) & 0xFF, 0xF1U);
  EXPECT_LT((column_after(0, 4) >> 4) & 15, kNibbleUnknown);
  EXPECT_GT((column_after(0, 5) >> 4) & 15, kNibbleUnknown);
}

TEST(TileEvidenceTest, AStretchFoldsInTheOrderOfItsSequence) {
  // Hits saturate at +64 in four; one miss before or after them differs.
  const auto occupancy_with_miss_at = [](std::uint32_t sequence) {
    std::vector<PlacedKeyframe> keyframes;
    for (std::uint32_t i = 1; i < 5; ++i) {
      keyframes.push_back(See({.occupancy = Occupancy::kObstacle}, {"car", "a", i}));
    }
    keyframes.push_back(See({.occupancy = Occupancy::kFree}, {"car", "a", sequence}));
    return Middle(keyframes)[0].occupancy;
  };
  EXPECT_EQ(occupancy_with_miss_at(9), 64 - 12);
  EXPECT_EQ(occupancy_with_miss_at(0), 64);
}

TEST(TileEvidenceTest, WhatStandsOnAWrongGuessDoesNotStandHere) {
  // A ramp's underside, in the way of who would drive on a deck that is not there: the ramp below
  // was measured, and is passed below it.
  const auto occupancy = [](double guess_m, const char* session) {
    const PlacedKeyframe ground = See({.z_m = 2.3}, {"car", "a", 1});
    const Deck guess{.z_m = guess_m,
                     .occupancy = Occupancy::kObstacle,
                     .source = AltitudeSource::kExtrapolated,
                     .column = 0xFFFF};
    const auto layers = Middle({ground, See(guess, {"car", session, 2})});
    EXPECT_EQ(layers.size(), 1u);
    EXPECT_NE(layers[0].column, 0u);  // what was seen at a height is there, whoever guessed what
    return layers[0].occupancy;
  };
  for (const char* session : {"a", "b"}) {  // of the same stretch, of another
    EXPECT_EQ(occupancy(2.3 + 0.9, session), -12) << session;
    EXPECT_EQ(occupancy(2.3 - 0.9, session), -12) << session;
    EXPECT_GT(occupancy(2.3 + 0.4, session), 0) << session;
  }
}

TEST(TileEvidenceTest, ALayerKnowsWhenItWasConfirmed) {
  const auto layers =
      Middle({See({.z_m = 0.0}, {"car", "a", 35}), See({.z_m = 5.5}, {"car", "b", 10}),
              See({.z_m = 0.0}, {"car", "c", 21})});
  ASSERT_EQ(layers.size(), 2u);
  EXPECT_EQ(layers[0].confirmed_s, 3u);  // 100 ms a sequence number
  EXPECT_EQ(layers[1].confirmed_s, 1u);
}

TEST(TileEvidenceTest, ColumnsStandOnTheWorldsLattice) {
  // Deck at 0.2 m, base offset 0.3 m: the base segment is [0, 1) m. The sensor is at 2.2 m, whose
  // nearest lattice index is 2, so that the keyframe's segments start at index 0.
  const auto layers = Middle({See({.z_m = 0.2, .column = 0x000006C0}, {})});
  EXPECT_EQ(layers[0].column, 0x00000'6C0u);
  // The deck at 0.8 m stands in segment [1, 2) m; the sensor at 2.8 m is nearest to index 3.
  EXPECT_EQ(Middle({See({.z_m = 0.8, .column = 0x000006C0}, {})})[0].column, 0x00000'6C0u);
  // At 0.6 m the sensor's index rounds up to 3 while the deck still stands in [0, 1) m.
  EXPECT_EQ(Middle({See({.z_m = 0.6, .column = 0x000006C0}, {})})[0].column, 0x00006C00u);
}

TEST(TileEvidenceTest, ColumnsNeverCrossTheNextDeck) {
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

}  // namespace
}  // namespace atlas
