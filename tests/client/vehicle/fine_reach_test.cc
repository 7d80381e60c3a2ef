#include "client/vehicle/fine_reach.h"

#include <gtest/gtest.h>

#include "tests/client/vehicle/sync_peer.h"

namespace atlas {
namespace {

constexpr double kRadius_m = 8.0;

std::vector<DiscPart> PartsAt(FineReach& reach, double x_m, double radius_m = kRadius_m) {
  return reach.PartsOf({{x_m, 0.0}, radius_m}, 0, TinyProfile());
}

TEST(FineReachTest, WithRoomADiscIsFollowedAsAWhole) {
  FineReach reach;
  const auto parts = PartsAt(reach, 1.0);
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_EQ(parts[0].disc.radius_m, kRadius_m);
  EXPECT_EQ(parts[0].finest_level, 0);
}

TEST(FineReachTest, EachTimeWithoutRoomHalvesWhatIsFine) {
  FineReach reach;
  reach.NoteNoRoom(PartsAt(reach, 1.0), TinyProfile());
  auto parts = PartsAt(reach, 1.0);
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_FALSE(IsWhole(parts, 0));
  EXPECT_EQ(parts[0].disc.radius_m, kRadius_m);
  EXPECT_EQ(parts[0].finest_level, 1);
  EXPECT_EQ(parts[1].disc.radius_m, kRadius_m / 2);
  EXPECT_EQ(parts[1].finest_level, 0);
  EXPECT_TRUE(IsWhole(PartsAt(reach, 1.0, kRadius_m / 2), 0)) << "as large a disc had room";
  reach.NoteNoRoom(parts, TinyProfile());
  parts = PartsAt(reach, 1.0);
  ASSERT_EQ(parts.size(), 3U);
  EXPECT_EQ(parts[2].disc.radius_m, kRadius_m / 4);
  EXPECT_EQ(parts[2].finest_level, 0);
}

// A disc of next to no radius may touch four tiles of each level all the same.
TEST(FineReachTest, WhereHalfAsFarIsNoLessTheFinestLevelIsGivenUpAndThenTheNext) {
  const MapProfile profile = TinyProfile();
  FineReach reach;
  std::vector<DiscPart> parts = PartsAt(reach, 1.0);
  while (parts.back().disc.radius_m >= 0.25 * profile.tile_size_m()) {
    reach.NoteNoRoom(parts, profile);
    parts = PartsAt(reach, 1.0);
    ASSERT_EQ(parts.back().finest_level, 0);
  }
  for (int level = 1; level < profile.levels; ++level) {
    reach.NoteNoRoom(parts, profile);
    parts = PartsAt(reach, 1.0);
    EXPECT_EQ(parts.back().finest_level, level);
    EXPECT_EQ(parts.front().disc.radius_m, kRadius_m);
  }
  for (int time = 0; time < 50; ++time) {
    reach.NoteNoRoom(parts, profile);
    parts = PartsAt(reach, 1.0);
    ASSERT_EQ(parts.size(), 1U);
    EXPECT_EQ(parts.back().finest_level, profile.levels - 1) << "it is all there is";
    EXPECT_FALSE(IsWhole(parts, 0));
  }
}

TEST(FineReachTest, ASmallDiscLosesItsFinestLevelAtOnce) {
  FineReach reach;
  reach.NoteNoRoom(PartsAt(reach, 0.0, 0.3), TinyProfile());
  const auto parts = PartsAt(reach, 0.0, 0.3);
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_EQ(parts[0].finest_level, 1);
  EXPECT_FALSE(IsWhole(parts, 0));
  EXPECT_TRUE(IsWhole(reach.PartsOf({{0.0, 0.0}, 0.3}, 1, TinyProfile()), 1)) << "as it was wanted";
}

TEST(FineReachTest, TheSmallDiscsStayUntilTheVehicleMoved) {
  FineReach reach;
  reach.NoteNoRoom(PartsAt(reach, 1.0), TinyProfile());
  EXPECT_EQ(PartsAt(reach, 1.9).back().disc.center_m.x(), 1.0);
  EXPECT_EQ(PartsAt(reach, 1.9).front().disc.center_m.x(), 1.9);
  EXPECT_EQ(PartsAt(reach, 2.1).back().disc.center_m.x(), 2.1);
  EXPECT_EQ(PartsAt(reach, 1.9).back().disc.center_m.x(), 2.1);
}

TEST(FineReachTest, ItGrowsElsewhereWhereFourTimesAsMuchHasRoom) {
  FineReach reach;
  reach.NoteNoRoom(PartsAt(reach, 0.0), TinyProfile());
  reach.NoteRoom(PartsAt(reach, 8.0), {.all = 10, .inner_half = 1, .room = 1'000});
  EXPECT_EQ(PartsAt(reach, 8.0).size(), 2U) << "it is where there was no room";
  reach.NoteRoom(PartsAt(reach, 9.0), {.all = 251, .inner_half = 1, .room = 1'000});
  EXPECT_EQ(PartsAt(reach, 9.0).size(), 2U) << "four times as much would be too much";
  reach.NoteRoom(PartsAt(reach, 9.0), {.all = 250, .inner_half = 1, .room = 1'000});
  EXPECT_TRUE(IsWhole(PartsAt(reach, 9.0), 0));
}

TEST(FineReachTest, AlongARoadTwiceAsFarIsTwiceAsMuch) {
  FineReach reach;
  reach.NoteNoRoom(PartsAt(reach, 0.0), TinyProfile());
  reach.NoteRoom(PartsAt(reach, 9.0), {.all = 501, .inner_half = 500, .room = 1'000});
  EXPECT_EQ(PartsAt(reach, 9.0).size(), 2U);
  reach.NoteRoom(PartsAt(reach, 9.0), {.all = 402, .inner_half = 160, .room = 1'000});
  EXPECT_EQ(PartsAt(reach, 9.0).size(), 2U) << "as it went on so far";
  reach.NoteRoom(PartsAt(reach, 9.0), {.all = 398, .inner_half = 160, .room = 1'000});
  EXPECT_TRUE(IsWhole(PartsAt(reach, 9.0), 0));
}

TEST(FineReachTest, TheInnerHalfIsOfEachPart) {
  FineReach reach;
  reach.NoteNoRoom(PartsAt(reach, 0.0), TinyProfile());
  const auto inner = InnerHalf(PartsAt(reach, 0.0));
  ASSERT_EQ(inner.size(), 2U);
  EXPECT_EQ(inner[0].disc.radius_m, kRadius_m / 2);
  EXPECT_EQ(inner[1].disc.radius_m, kRadius_m / 4);
  EXPECT_EQ(inner[1].finest_level, 0);
}

// Each call a step, until there is no room again.
TEST(FineReachTest, ElsewhereTheLevelsComeBackInTurnAndThenItGrows) {
  const MapProfile profile = TinyProfile();
  FineReach reach;
  for (int time = 0; time < 20; ++time) {
    reach.NoteNoRoom(PartsAt(reach, 0.0), profile);
  }
  for (int level = profile.levels - 2; level >= 0; --level) {
    reach.NoteRoom(PartsAt(reach, 9.0), {.all = 501, .inner_half = 501, .room = 1'000});
    EXPECT_EQ(PartsAt(reach, 9.0).back().finest_level, level + 1) << "twice as much is too much";
    reach.NoteRoom(PartsAt(reach, 9.0), {.all = 500, .inner_half = 500, .room = 1'000});
    EXPECT_EQ(PartsAt(reach, 9.0).back().finest_level, level);
  }
  const double least_m = PartsAt(reach, 9.0).back().disc.radius_m;
  EXPECT_LT(least_m, 0.25 * profile.tile_size_m());
  reach.NoteRoom(PartsAt(reach, 9.0), {.all = 10, .inner_half = 10, .room = 1'000});
  EXPECT_EQ(PartsAt(reach, 9.0).back().disc.radius_m, 2.0 * least_m);
  reach.NoteNoRoom(PartsAt(reach, 9.0), profile);
  reach.NoteRoom(PartsAt(reach, 9.0), {.all = 10, .inner_half = 10, .room = 1'000});
  EXPECT_EQ(PartsAt(reach, 9.0).back().disc.radius_m, least_m) << "not where there was no room";
}

}  // namespace
}  // namespace atlas
