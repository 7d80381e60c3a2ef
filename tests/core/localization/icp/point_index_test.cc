// Nearest points against a search of all.
#include "core/localization/icp/point_index.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "core/base/hash_random.h"

namespace atlas {
namespace {

std::vector<Eigen::Vector3f> RandomPoints(std::uint64_t seed, int count) {
  HashRandom random(seed);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < count; ++i) {
    points.emplace_back(random.Uniform(-10, 10), random.Uniform(-10, 10), random.Uniform(-2, 2));
  }
  return points;
}

TEST(PointIndexTest, FindsWhatASearchOfAllFinds) {
  const PointIndex index(RandomPoints(1, 500));
  std::vector<NearPoint> found;
  for (const Eigen::Vector3f& p : RandomPoints(2, 200)) {
    std::vector<float> distances;
    for (const Eigen::Vector3f& q : index.points()) distances.push_back((q - p).norm());
    std::sort(distances.begin(), distances.end());
    const auto near = index.Nearest(p, 100.0F);
    ASSERT_TRUE(near.has_value());
    EXPECT_NEAR(near->distance_m, distances[0], 1e-5F);
    EXPECT_NEAR((index.points()[near->index] - p).norm(), distances[0], 1e-5F);
    index.Nearest(p, 100.0F, 7, found);
    ASSERT_EQ(found.size(), 7U);
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_NEAR(found[i].distance_m, distances[i], 1e-5F);
    }
  }
}

TEST(PointIndexTest, NothingIsFoundBeyondTheReach) {
  const PointIndex index({{0, 0, 0}, {3, 0, 0}});
  EXPECT_FALSE(index.Nearest({1.4F, 0, 0}, 1.3F).has_value());
  EXPECT_EQ(index.Nearest({1.6F, 0, 0}, 1.5F)->index, 1U);
  std::vector<NearPoint> found;
  index.Nearest({1.0F, 0, 0}, 1.5F, 2, found);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].index, 0U);
}

TEST(PointIndexTest, OfFewerPointsThanAskedForAllAreGiven) {
  const PointIndex index({{0, 0, 0}, {1, 0, 0}});
  std::vector<NearPoint> found{{9, 9.0F}};
  index.Nearest({0, 0, 0}, 10.0F, 5, found);
  EXPECT_EQ(found.size(), 2U);
}

TEST(PointIndexTest, AnEmptyCloudHasNoNearest) {
  const PointIndex index({});
  std::vector<NearPoint> found{{9, 9.0F}};
  EXPECT_FALSE(index.Nearest({0, 0, 0}, 10.0F).has_value());
  index.Nearest({0, 0, 0}, 10.0F, 3, found);
  EXPECT_TRUE(found.empty());
}

TEST(PointIndexTest, SurvivesBeingMovedAndManyEqualPoints) {
  PointIndex first(std::vector<Eigen::Vector3f>(200, Eigen::Vector3f(1, 2, 3)));
  const PointIndex index(std::move(first));
  EXPECT_NEAR(index.Nearest({1, 2, 4}, 2.0F)->distance_m, 1.0F, 1e-6F);
}

}  // namespace
}  // namespace atlas
