#include "core/traversability/window_plane.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace atlas {
namespace {

constexpr float kThreshold_m = 0.12F;
const PlaneFitOptions kOptions{kThreshold_m, TripleChoice::kOneInARing, 0.0F};
constexpr std::size_t kPadding = 16;

// Three rings of returns in one window of azimuth, as points of the world over z = height(x, y).
template <typename Height>
std::vector<Eigen::Vector3f> ThreeRings(int columns, const Height& height) {
  std::vector<Eigen::Vector3f> points;
  for (int ring = 0; ring < 3; ++ring) {
    for (int column = 0; column < columns; ++column) {
      const float range_m = 6.0F + 1.5F * static_cast<float>(ring);
      const float azimuth_rad =
          0.17F * (static_cast<float>(column) + 0.5F) / static_cast<float>(columns);
      const float x = range_m * std::cos(azimuth_rad);
      const float y = range_m * std::sin(azimuth_rad);
      points.emplace_back(x, y, height(x, y));
    }
  }
  return points;
}

WindowReturns WindowOf(const std::vector<Eigen::Vector3f>& points,
                       std::array<std::uint32_t, 4> ring_begin) {
  WindowReturns window;
  window.ring_begin = ring_begin;
  for (const Eigen::Vector3f& p : points) {
    window.x.push_back(p.x());
    window.y.push_back(p.y());
    window.z.push_back(p.z());
  }
  for (std::vector<float>* plane : {&window.x, &window.y, &window.z}) {
    plane->resize(points.size() + kPadding, std::numeric_limits<float>::infinity());
  }
  return window;
}

WindowReturns WindowOf(const std::vector<Eigen::Vector3f>& points) {
  const auto third = static_cast<std::uint32_t>(points.size() / 3);
  return WindowOf(points, {0, third, 2 * third, 3 * third});
}

std::uint32_t CountNear(const std::vector<Eigen::Vector3f>& points, const Plane& plane) {
  return static_cast<std::uint32_t>(
      std::count_if(points.begin(), points.end(), [&](const Eigen::Vector3f& p) {
        return std::abs(plane.normal.dot(p) + plane.offset_m) < kThreshold_m;
      }));
}

TEST(WindowPlaneTest, FindsAPlaneInAnyAttitude) {
  for (const float east : {-0.4F, 0.0F, 0.2F}) {
    for (const float north : {-0.3F, 0.0F, 0.36F}) {
      const auto points =
          ThreeRings(20, [&](float x, float y) { return -1.8F + east * x + north * y; });
      const auto fit = FitPlane(WindowOf(points), kOptions);
      ASSERT_TRUE(fit.has_value());
      EXPECT_EQ(fit->inliers, points.size());
      const Eigen::Vector3f truth = Eigen::Vector3f(-east, -north, 1.0F).normalized();
      EXPECT_GT(std::abs(fit->plane.normal.dot(truth)), 0.9999F);
      EXPECT_NEAR(fit->plane.normal.norm(), 1.0F, 1e-5F);
    }
  }
}

TEST(WindowPlaneTest, CountsEveryReturnOfAnyWindowOnce) {
  std::mt19937 random(41);
  std::normal_distribution<float> noise(0.0F, 0.1F);
  for (int columns = 1; columns < 40; ++columns) {  // whole vectors and every remainder
    const auto points = ThreeRings(columns, [&](float, float) { return -1.8F + noise(random); });
    const auto fit = FitPlane(WindowOf(points), kOptions);
    ASSERT_TRUE(fit.has_value()) << columns;
    // A return at the threshold itself may round either way.
    EXPECT_NEAR(fit->inliers, CountNear(points, fit->plane), 1) << columns;
    EXPECT_LE(fit->inliers, points.size());
  }
}

TEST(WindowPlaneTest, TheMajorityWinsOverClutter) {
  std::mt19937 random(42);
  for (int round = 0; round < 50; ++round) {
    const auto points = ThreeRings(30, [&](float, float) {
      const bool is_clutter = random() % 10 < 4;
      return is_clutter ? -1.5F + 0.01F * static_cast<float>(random() % 150) : -1.8F;
    });
    const auto fit = FitPlane(WindowOf(points), kOptions);
    ASSERT_TRUE(fit.has_value());
    EXPECT_GT(std::abs(fit->plane.normal.z()), 0.98F) << round;
    EXPECT_NEAR(std::abs(fit->plane.offset_m), 1.8F, 0.5F) << round;
  }
}

TEST(WindowPlaneTest, NoPlaneGoesThroughALineOrAPoint) {
  std::vector<Eigen::Vector3f> line;
  for (int i = 0; i < 30; ++i) {
    line.emplace_back(5.0F + static_cast<float>(i), 2.0F * static_cast<float>(i), 0.5F);
  }
  EXPECT_FALSE(FitPlane(WindowOf(line), kOptions).has_value());
  const std::vector<Eigen::Vector3f> point(30, Eigen::Vector3f(5.0F, 1.0F, -1.0F));
  EXPECT_FALSE(FitPlane(WindowOf(point), kOptions).has_value());
}

TEST(WindowPlaneTest, AnEmptyRingIsReplacedByAnother) {
  const auto points = ThreeRings(10, [](float, float) { return -1.8F; });
  for (const std::array<std::uint32_t, 4> begin :
       {std::array<std::uint32_t, 4>{0, 0, 15, 30}, {0, 15, 15, 30}, {0, 15, 30, 30}}) {
    const WindowReturns window = WindowOf(points, begin);
    EXPECT_EQ(window.FilledRings(), 2);
    const auto fit = FitPlane(window, kOptions);
    ASSERT_TRUE(fit.has_value());
    EXPECT_EQ(fit->inliers, 30U);
  }
  EXPECT_EQ(WindowOf(points, {0, 0, 0, 30}).FilledRings(), 1);
  EXPECT_EQ(WindowOf(points, {0, 10, 20, 30}).FilledRings(), 3);
  EXPECT_EQ(WindowOf({}).FilledRings(), 0);
}

TEST(WindowPlaneTest, IsTheSameEveryTime) {
  std::mt19937 random(43);
  std::normal_distribution<float> noise(0.0F, 0.3F);
  const auto points = ThreeRings(25, [&](float, float) { return -1.8F + noise(random); });
  const auto first = FitPlane(WindowOf(points), kOptions);
  const auto second = FitPlane(WindowOf(points), kOptions);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->plane.normal, second->plane.normal);
  EXPECT_EQ(first->plane.offset_m, second->plane.offset_m);
  EXPECT_EQ(first->inliers, second->inliers);
}

}  // namespace
}  // namespace atlas
