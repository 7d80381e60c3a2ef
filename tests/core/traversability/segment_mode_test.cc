// What the paper's algorithm calls ground and ours does not, and the other way round.
#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include <gtest/gtest.h>

#include "core/traversability/segmenter.h"
#include "tests/core/traversability/segmented_world.h"

namespace atlas {
namespace {

using testing::Box;
using testing::CastScan;
using testing::FlatWorld;
using testing::kHeight_m;
using testing::kSensors;
using testing::LayoutOf;
using testing::Patch;
using testing::Segment;
using testing::Segmented;
using testing::SensorAt;
using testing::ShapeWorld;
using testing::Surface;
using testing::SyntheticSensor;
using testing::TruthScan;

const Eigen::Vector3d kUp = Eigen::Vector3d::UnitZ();

ShapeWorld RandomWorld(std::mt19937& random) {
  std::uniform_real_distribution<double> place(-25.0, 25.0);
  std::uniform_real_distribution<double> size(0.3, 5.0);
  std::uniform_real_distribution<double> slope(-0.2, 0.2);
  ShapeWorld world = FlatWorld();
  world.patches[0].gradient = {slope(random), slope(random)};
  while (world.boxes.size() < 12) {
    const Eigen::Vector3d low(place(random), place(random), -5.0);
    if (low.head<2>().norm() > 8.0) {
      world.boxes.push_back(Box{low, low + Eigen::Vector3d(size(random), size(random), 10.0)});
    }
  }
  return world;
}

TEST(SegmentModeTest, PaperTakesACeilingForGroundAndAtlasDoesNot) {
  ShapeWorld world;
  world.patches = {Patch{}, Patch{2.6, {0.0, 0.0}, Surface::kCeiling}};
  const TruthScan scan = CastScan(kSensors[0], world, SensorAt(kHeight_m));
  const Segmented paper = Segment(kSensors[0], scan, kUp, SegmentMode::kPaper);
  const Segmented atlas = Segment(kSensors[0], scan, kUp, SegmentMode::kAtlas);
  EXPECT_GT(paper.Count(Surface::kCeiling).share(), 0.9);
  EXPECT_EQ(atlas.Count(Surface::kCeiling).ground, 0);
  EXPECT_GT(atlas.CountWithin(Surface::kGround, 12.0F).share(), 0.99);
}

TEST(SegmentModeTest, PaperTakesMoreWallForGroundThanAtlas) {
  std::mt19937 random(61);
  int paper = 0;
  int atlas = 0;
  for (int round = 0; round < 5; ++round) {
    const TruthScan scan = CastScan(kSensors[2], RandomWorld(random), SensorAt(kHeight_m));
    const auto wall = [&scan](SegmentMode mode) {
      return Segment(kSensors[2], scan, kUp, mode).Count(Surface::kWall).ground;
    };
    paper += wall(SegmentMode::kPaper);
    atlas += wall(SegmentMode::kAtlas);
  }
  EXPECT_GT(paper, 2 * atlas);
}

TEST(SegmentModeTest, SaysTheSameEveryTimeAndNothingButYesAndNo) {
  std::mt19937 random(63);
  for (const SyntheticSensor& sensor : kSensors) {
    const TruthScan scan = CastScan(sensor, RandomWorld(random), SensorAt(kHeight_m));
    for (const SegmentMode mode : {SegmentMode::kPaper, SegmentMode::kAtlas}) {
      const Segmented first = Segment(sensor, scan, kUp, mode);
      EXPECT_EQ(first.is_ground, Segment(sensor, scan, kUp, mode).is_ground);
      EXPECT_TRUE(std::all_of(first.is_ground.begin(), first.is_ground.end(),
                              [](std::uint8_t value) { return value <= 1; }));
    }
  }
}

// Three rings with three returns each on almost flat ground, two of them at exactly x == y.
RangeImage DiagonalWindow() {
  RangeImage image;
  image.rows = 3;
  image.sector_begin.push_back(0);
  for (int row = 0; row < 3; ++row) {
    const float far = 6.0F + 2.0F * static_cast<float>(row);
    for (int sector = 0; sector < RangeImage::kSectors; ++sector) {
      if (sector == 9) {  // 45 to 50 degrees
        for (const auto& [x, y] : {std::pair(far, far), std::pair(far + 0.5F, far + 0.5F),
                                   std::pair(far - 0.15F, far + 0.15F)}) {
          image.x.push_back(x);
          image.y.push_back(y);
          image.z.push_back(row == 1 ? -1.75F : -1.8F);  // else the diagonal is a line
          image.source.push_back(static_cast<std::uint32_t>(image.source.size()));
        }
      }
      image.sector_begin.push_back(static_cast<std::uint32_t>(image.source.size()));
    }
  }
  for (std::vector<float>* plane : {&image.x, &image.y, &image.z}) {
    plane->resize(image.size() + RangeImage::kPadding, 1e6F);
  }
  return image;
}

TEST(SegmentModeTest, ThePaddingOfAWindowLiesOnNoPlane) {
  // The upright plane x == y holds six returns of nine; padding on it would outvote the ground.
  const auto is_ground = Segmenter({}).Segment(DiagonalWindow(), Eigen::Vector3f::UnitZ());
  EXPECT_EQ(std::count(is_ground.begin(), is_ground.end(), 1), 9);
}

}  // namespace
}  // namespace atlas
