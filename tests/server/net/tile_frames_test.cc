#include "server/net/requests/tile_frames.h"

#include <cstdint>
#include <memory>

#include <gtest/gtest.h>

namespace atlas {
namespace {

std::shared_ptr<const TileBody> BodyOf(std::uint64_t key, std::size_t bytes = 10) {
  return std::make_shared<const TileBody>(TileBody::Create({key, 5, 6, 0}, Bytes(bytes)).value());
}

TEST(TileFramesTest, AreFoundByAllThatTheyAre) {
  TileFrames frames(1u << 20);
  const auto body = BodyOf(1);
  frames.Insert({1, 5, kAllSections}, body);
  EXPECT_EQ(frames.Find({1, 5, kAllSections}), body);
  EXPECT_EQ(frames.Find({2, 5, kAllSections}), nullptr);
  EXPECT_EQ(frames.Find({1, 4, kAllSections}), nullptr);
  EXPECT_EQ(frames.Find({1, 5, 2}), nullptr);
}

TEST(TileFramesTest, LeaveByTheirAge) {
  TileFrames frames(10'000);
  for (std::uint64_t key = 1; key <= 20; ++key) {
    frames.Insert({key, 5, kAllSections}, BodyOf(key, 1'000));
    EXPECT_NE(frames.Find({1, 5, kAllSections}), nullptr) << "used each time";
  }
  EXPECT_EQ(frames.Find({2, 5, kAllSections}), nullptr);
  EXPECT_NE(frames.Find({20, 5, kAllSections}), nullptr);
}

TEST(TileFramesTest, OneLargerThanAllRoomIsNotKept) {
  TileFrames frames(500);
  frames.Insert({1, 5, kAllSections}, BodyOf(1, 1'000));
  EXPECT_EQ(frames.Find({1, 5, kAllSections}), nullptr);
}

}  // namespace
}  // namespace atlas
