// Gradients of planes, with holes and with noise.
#include "core/planning/surface/plane_fit.h"

#include <random>

#include <gtest/gtest.h>

namespace atlas {
namespace {

TEST(PlaneFitTest, FindsTheGradientOfAnyPlane) {
  PlaneFit fit;
  for (int y = -3; y <= 3; ++y) {
    for (int x = -2; x <= 4; ++x) {
      if ((x * 7 + y * 3) % 4 != 0) {
        fit.Add(x, y, 5.0 + 0.3 * x - 0.4 * y);
      }
    }
  }
  ASSERT_TRUE(fit.Gradient().has_value());
  EXPECT_NEAR(*fit.Gradient(), 0.5, 1e-12);
}

TEST(PlaneFitTest, TooFewHeightsOrALineOfThemHaveNone) {
  PlaneFit few;
  few.Add(0, 0, 1.0);
  few.Add(1, 0, 1.0);
  few.Add(0, 1, 1.0);
  EXPECT_FALSE(few.Gradient().has_value());
  PlaneFit line;
  for (int i = 0; i < 20; ++i) {
    line.Add(i, 2 * i, 1.0);
  }
  EXPECT_FALSE(line.Gradient().has_value());
}

TEST(PlaneFitTest, NoiseAveragesOut) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise_m(0.0, 0.03);
  PlaneFit fit;
  for (int y = -4; y <= 4; y += 2) {
    for (int x = -4; x <= 4; x += 2) {
      fit.Add(x, y, noise_m(random));
    }
  }
  EXPECT_LT(*fit.Gradient(), 0.0087);  // 5 degrees over cells of 0.1 m
}

}  // namespace
}  // namespace atlas
