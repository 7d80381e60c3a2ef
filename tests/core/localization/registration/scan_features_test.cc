#include "core/localization/registration/scan_features.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <tuple>

#include <gtest/gtest.h>

#include "tests/core/support/shape_world.h"

namespace atlas {
namespace {

using testing::AddReturn;

using Voxel = std::tuple<int, int, int>;

Voxel VoxelOf(const Eigen::Vector3f& p, float side_m, float height_m) {
  return {static_cast<int>(std::floor(p.x() / side_m)),
          static_cast<int>(std::floor(p.y() / side_m)),
          static_cast<int>(std::floor(p.z() / height_m))};
}

LeveledScan RandomScan(std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> place(-45.0F, 45.0F);
  std::uniform_real_distribution<float> above(-1.5F, 4.0F);
  LeveledScan scan;
  for (int i = 0; i < 20'000; ++i) {
    const bool is_ground = i % 2 == 0;
    AddReturn(scan, {place(random), place(random), is_ground ? -1.8F : above(random)}, is_ground);
  }
  return scan;
}

TEST(ScanFeaturesTest, AVoxelsReturnsBecomeTheirMean) {
  LeveledScan scan;
  AddReturn(scan, {5.02F, -3.02F, 0.1F}, false);
  AddReturn(scan, {5.12F, -3.12F, 0.3F}, false);
  AddReturn(scan, {5.02F, -3.02F, 0.6F}, false);  // another half metre
  AddReturn(scan, {5.02F, -3.02F, -1.8F}, true);
  AddReturn(scan, {5.92F, -3.92F, -1.6F}, true);
  const ScanFeatures features = ExtractFeatures(scan, {});
  ASSERT_EQ(features.columns.size(), 2U);
  EXPECT_LT((features.columns[0] - Eigen::Vector3f(5.07F, -3.07F, 0.2F)).norm(), 1e-5F);
  EXPECT_LT((features.columns[1] - Eigen::Vector3f(5.02F, -3.02F, 0.6F)).norm(), 1e-5F);
  ASSERT_EQ(features.ground.size(), 1U);
  EXPECT_LT((features.ground[0] - Eigen::Vector3f(5.47F, -3.47F, -1.7F)).norm(), 1e-5F);
}

TEST(ScanFeaturesTest, EveryVoxelInRangeHasOnePointWithinIt) {
  const FeatureOptions options;
  const LeveledScan scan = RandomScan(111);
  std::set<Voxel> columns;
  std::set<Voxel> ground;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (scan.range_m[i] <= options.max_range_m) {
      const Eigen::Vector3f p(scan.x[i], scan.y[i], scan.z[i]);
      (scan.is_ground[i] != 0 ? ground : columns)
          .insert(scan.is_ground[i] != 0
                      ? VoxelOf(p, options.ground_voxel_m, 1e4F)
                      : VoxelOf(p, options.column_voxel_m, options.column_height_m));
    }
  }
  const ScanFeatures features = ExtractFeatures(scan, options);
  EXPECT_EQ(features.columns.size(), columns.size());
  EXPECT_EQ(features.ground.size(), ground.size());
  std::set<Voxel> seen;
  for (const Eigen::Vector3f& p : features.columns) {
    seen.insert(VoxelOf(p, options.column_voxel_m, options.column_height_m));
  }
  EXPECT_EQ(seen, columns);
}

TEST(ScanFeaturesTest, TheOrderOfReturnsMattersNoMoreThanRounding) {
  LeveledScan scan = RandomScan(112);
  const ScanFeatures first = ExtractFeatures(scan, {});
  for (std::vector<float>* plane : {&scan.x, &scan.y, &scan.z, &scan.range_m}) {
    std::reverse(plane->begin(), plane->end());
  }
  std::reverse(scan.is_ground.begin(), scan.is_ground.end());
  const ScanFeatures second = ExtractFeatures(scan, {});
  ASSERT_EQ(first.columns.size(), second.columns.size());
  for (std::size_t i = 0; i < first.columns.size(); ++i) {
    ASSERT_LT((first.columns[i] - second.columns[i]).norm(), 1e-4F);
  }
}

TEST(ScanFeaturesTest, TheSameScanHasTheSameFeatures) {
  const ScanFeatures first = ExtractFeatures(RandomScan(113), {});
  const ScanFeatures second = ExtractFeatures(RandomScan(113), {});
  EXPECT_EQ(first.columns, second.columns);
  EXPECT_EQ(first.ground, second.ground);
}

TEST(ScanFeaturesTest, WhatAnExtractorSawBeforeDoesNotMatter) {
  FeatureExtractor extractor({});
  for (const unsigned seed : {114U, 115U, 116U}) {
    const ScanFeatures& again = extractor.Extract(RandomScan(seed));
    const ScanFeatures fresh = ExtractFeatures(RandomScan(seed), {});
    EXPECT_EQ(again.columns, fresh.columns);
    EXPECT_EQ(again.ground, fresh.ground);
    EXPECT_EQ(again.returns, fresh.returns);
  }
  EXPECT_TRUE(extractor.Extract(LeveledScan()).columns.empty());
}

TEST(ScanFeaturesTest, AnEmptyScanAndOneOutOfRangeHaveNone) {
  LeveledScan scan;
  for (int round = 0; round < 2; ++round) {
    const ScanFeatures features = ExtractFeatures(scan, {});
    EXPECT_TRUE(features.columns.empty() && features.ground.empty());
    AddReturn(scan, {40.1F, 0.0F, 1.0F}, false);
    AddReturn(scan, {0.0F, -900.0F, -999.0F}, true);
  }
}

}  // namespace
}  // namespace atlas
