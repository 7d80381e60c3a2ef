#include "client/cli/files/pose_file.h"

#include <gtest/gtest.h>

namespace atlas {
namespace {

constexpr const char* kIdentity = "1 0 0 2.5 0 1 0 -3 0 0 1 0.25";

std::string Line(const std::string& key) {
  return key + " " + kIdentity + "\n";
}

TEST(PoseFileTest, ReadsLinesCommentsAndBlanks) {
  const auto poses = ParsePoseFile("# corrected\n\n" + Line("car monday 3") + "  \r\n" +
                                   "\tcar\ttuesday 4 " + kIdentity + "\r\n");
  ASSERT_TRUE(poses) << poses.error().message();
  ASSERT_EQ(poses->size(), 2U);
  EXPECT_EQ(poses->front().key, (KeyframeKey{{"car", "monday"}, 3}));
  EXPECT_EQ(poses->front().T_world_sensor.x_um, 2'500'000);
  EXPECT_EQ(poses->front().T_world_sensor.y_um, -3'000'000);
  EXPECT_EQ(poses->front().T_world_sensor.z_um, 250'000);
  EXPECT_EQ(poses->back().key.session.session, "tuesday");
}

TEST(PoseFileTest, LastLineNeedsNoNewline) {
  EXPECT_EQ(ParsePoseFile(std::string("car monday 3 ") + kIdentity)->size(), 1U);
}

TEST(PoseFileTest, RefusesEveryOtherFormNamingTheLine) {
  const std::vector<std::string> bad = {
      "car monday 3 1 0 0\n",
      Line("car monday 3 extra"),
      Line("car monday -1"),
      Line("car monday 99999999999"),
      Line("car mon/day 1"),
      "car monday 3 1 0 0 0 0 1 0 0 0 0 nan 0\n",
      "car monday 3 1 0 0 0 0 1 0 0 0 0 x 0\n",
      "car monday 3 2 0 0 0 0 2 0 0 0 0 2 0\n",     // no rotation
      "car monday 3 1 0 0 1e12 0 1 0 0 0 0 1 0\n",  // off the planet
  };
  for (const std::string& text : bad) {
    const auto poses = ParsePoseFile("# first\n" + text);
    ASSERT_FALSE(poses) << text;
    EXPECT_EQ(poses.error().code(), StatusCode::kInvalidData) << text;
    EXPECT_EQ(poses.error().message().rfind("line 2", 0), 0U) << poses.error().message();
  }
}

TEST(PoseFileTest, OneKeyframeOneBatchOnePose) {
  const auto poses = ParsePoseFile(Line("car monday 3") + Line("car monday 3"));
  ASSERT_FALSE(poses);
  EXPECT_NE(poses.error().message().find("line 1"), std::string::npos);
}

TEST(PoseFileTest, EmptyFileIsNoBatch) {
  EXPECT_FALSE(ParsePoseFile(""));
  EXPECT_FALSE(ParsePoseFile("# nothing\n"));
}

}  // namespace
}  // namespace atlas
