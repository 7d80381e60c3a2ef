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
  reach.NoteNoRoom(PartsAt(reach, 1.0), 100);
  auto parts = PartsAt(reach, 1.0);
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_EQ(parts[0].disc.radius_m, kRadius_m);
  EXPECT_EQ(parts[0].finest_level, 1);
  EXPECT_EQ(parts[1].disc.radius_m, kRadius_m / 2);
  EXPECT_EQ(parts[1].finest_level, 0);
  EXPECT_EQ(PartsAt(reach, 1.0, kRadius_m / 2).size(), 1U) << "as large a disc had room";
  for (int time = 0; time < 50; ++time) {
    reach.NoteNoRoom(PartsAt(reach, 1.0), 100);
  }
  parts = PartsAt(reach, 1.0);
  EXPECT_EQ(parts.size(), TinyProfile().levels);
  EXPECT_EQ(parts[0].disc.radius_m, kRadius_m);
}

TEST(FineReachTest, TheSmallDiscsStayUntilTheVehicleMoved) {
  FineReach reach;
  reach.NoteNoRoom(PartsAt(reach, 1.0), 100);
  EXPECT_EQ(PartsAt(reach, 1.9).back().disc.center_m.x(), 1.0);
  EXPECT_EQ(PartsAt(reach, 1.9).front().disc.center_m.x(), 1.9);
  EXPECT_EQ(PartsAt(reach, 2.1).back().disc.center_m.x(), 2.1);
  EXPECT_EQ(PartsAt(reach, 1.9).back().disc.center_m.x(), 2.1);
}

TEST(FineReachTest, ItGrowsElsewhereWhereThereIsLittle) {
  FineReach reach;
  reach.NoteNoRoom(PartsAt(reach, 0.0), 100);
  reach.NoteRoom(PartsAt(reach, 1.0), 10);
  EXPECT_EQ(PartsAt(reach, 1.0).size(), 2U) << "it is where there was no room";
  reach.NoteRoom(PartsAt(reach, 10.0), 13);
  EXPECT_EQ(PartsAt(reach, 10.0).size(), 2U) << "four times as many would be too many";
  reach.NoteRoom(PartsAt(reach, 10.0), 12);
  EXPECT_EQ(PartsAt(reach, 10.0).size(), 1U);
}

}  // namespace
}  // namespace atlas
