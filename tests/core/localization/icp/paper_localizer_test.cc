// Posts in a keyframe and the same posts in a map, some cells off.
#include "core/localization/icp/paper_localizer.h"

#include <numbers>

#include <gtest/gtest.h>

#include "core/base/hash_random.h"
#include "tests/core/localization/painted_map.h"

namespace atlas {
namespace {

using testing::PaintedMap;

struct Post {
  std::int32_t x = 0;  // cells
  std::int32_t y = 0;
};

std::vector<Post> Posts() {
  HashRandom random(5);
  std::vector<Post> posts;
  for (std::int32_t x = -90; x < 90; x += 20) {
    for (std::int32_t y = -90; y < 90; y += 20) {
      posts.push_back({x + static_cast<std::int32_t>(random.Below(10)),
                       y + static_cast<std::int32_t>(random.Below(10))});
    }
  }
  return posts;
}

// Each post is occupied from the ground, 1.8 m below the sensor, to 1.2 m above it.
Keyframe Scan(const std::vector<Post>& posts) {
  Keyframe keyframe;
  keyframe.profile_hash = MapProfile().Hash();
  keyframe.grid = {100'000, 100};
  keyframe.sensor_height_mm = 1'800;
  keyframe.cells.resize(keyframe.grid.size());
  keyframe.columns.resize(keyframe.grid.size());
  keyframe.anchors.assign(keyframe.block_count(), -2);
  for (const Post& post : posts) {
    keyframe.columns[keyframe.grid.Index(post.x, post.y)] = 0x1CCC;
  }
  return keyframe;
}

// The sensor of Scan() is at (3, -2, 5).
PaintedMap MapOf(const std::vector<Post>& posts) {
  PaintedMap map;
  for (const Post& post : posts) {
    map.Put(post.x + 30, post.y - 20, testing::ColumnLayer(3.2, 0b111));
  }
  return map;
}

Pose At(double x, double y, double z, double yaw_deg) {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::AngleAxisd(yaw_deg * std::numbers::pi / 180.0, Eigen::Vector3d::UnitZ())
                      .toRotationMatrix();
  pose.translation() = Eigen::Vector3d(x, y, z);
  return pose;
}

const Eigen::Quaterniond kLevel = Eigen::Quaterniond::Identity();

TEST(PaperLocalizerTest, DecodesWhatIsOccupiedInTheLevelledFrame) {
  const std::vector<Eigen::Vector3f> points = DecodeColumns(Scan({{-3, 7}}), MapProfile());
  ASSERT_EQ(points.size(), 3U);
  EXPECT_TRUE(points[0].isApprox(Eigen::Vector3f(-0.25F, 0.75F, -1.5F), 1e-6F));
  EXPECT_TRUE(points[2].isApprox(Eigen::Vector3f(-0.25F, 0.75F, 0.5F), 1e-6F));
  EXPECT_EQ(DecodeColumns(Scan({{-3, 7}}), MapProfile(), 1).size(), 4U);
}

TEST(PaperLocalizerTest, FindsTheScanInTheMap) {
  const PaintedMap map = MapOf(Posts());
  PaperLocalizer localizer(map.profile(), map.Source(), {});
  localizer.Start(At(3.3, -2.25, 5.1, 1.0));
  const auto result = localizer.Localize(Scan(Posts()), kLevel);
  ASSERT_TRUE(result.has_value());
  EXPECT_FALSE(result->is_lost);
  EXPECT_DOUBLE_EQ(result->fit, 1.0);
  EXPECT_LT((result->T_world_sensor.translation() - Eigen::Vector3d(3, -2, 5)).norm(), 0.002);
  EXPECT_LT(Eigen::AngleAxisd(result->T_world_sensor.linear()).angle(), 1e-3);
}

TEST(PaperLocalizerTest, TheLevellingTurnIsPartOfTheAnswer) {
  const PaintedMap map = MapOf(Posts());
  PaperLocalizer localizer(map.profile(), map.Source(), {});
  const Eigen::Quaterniond level(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX()));
  localizer.Start(At(3.1, -2.1, 5.0, 0.5));
  const auto result = localizer.Localize(Scan(Posts()), level);
  ASSERT_TRUE(result.has_value());
  EXPECT_LT(Eigen::Quaterniond(result->T_world_sensor.linear()).angularDistance(level), 1e-3);
}

TEST(PaperLocalizerTest, StartsFromWhereTheLastScanWasFound) {
  const PaintedMap map = MapOf(Posts());
  PaperLocalizer localizer(map.profile(), map.Source(), {});
  localizer.Start(At(3.5, -2.0, 5.0, 0.0));
  ASSERT_TRUE(localizer.Localize(Scan(Posts()), kLevel).has_value());
  std::vector<Post> ahead = Posts();  // the vehicle drove 0.8 m on: 1.3 m from where it started
  for (Post& post : ahead) post.x += 8;
  const auto result = localizer.Localize(Scan(ahead), kLevel);
  ASSERT_TRUE(result.has_value());
  EXPECT_LT((result->T_world_sensor.translation() - Eigen::Vector3d(2.2, -2, 5)).norm(), 0.002);
}

TEST(PaperLocalizerTest, WithoutAMapItIsLostWhereItWas) {
  const PaintedMap empty;
  PaperLocalizer localizer(empty.profile(), empty.Source(), {});
  localizer.Start(At(1.0, 2.0, 3.0, 4.0));
  const auto result = localizer.Localize(Scan(Posts()), kLevel);
  ASSERT_TRUE(result.has_value());
  EXPECT_TRUE(result->is_lost);
  EXPECT_TRUE(result->T_world_sensor.isApprox(At(1.0, 2.0, 3.0, 4.0), 1e-6));
}

TEST(PaperLocalizerTest, ErrorsOfTheSourceAreItsOwn) {
  PaperLocalizer localizer(
      MapProfile(),
      [](const Eigen::Vector3d&, double) -> Result<std::vector<std::shared_ptr<const Tile>>> {
        return Error(StatusCode::kUnavailable, "gone");
      },
      {});
  localizer.Start(At(0, 0, 0, 0));
  const auto result = localizer.Localize(Scan({}), kLevel);
  ASSERT_FALSE(result.has_value());
  EXPECT_EQ(result.error().code(), StatusCode::kUnavailable);
}

}  // namespace
}  // namespace atlas
