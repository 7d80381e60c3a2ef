// Two keyframes that follow each other: what no vehicle does, and what some do.
#include "server/store/plausibility.h"

#include <limits>

#include <gtest/gtest.h>

namespace atlas {
namespace {

constexpr std::int64_t kMetre_um = 1'000'000;

UploadedPlace At(std::uint32_t sequence, std::int64_t time_ms, std::int64_t x_m, std::int64_t z_m) {
  return {sequence, time_ms, x_m * kMetre_um, 0, z_m * kMetre_um};
}

bool IsPlausible(const UploadedPlace& a, const UploadedPlace& b, const PlausibilityLimits& l = {}) {
  EXPECT_EQ(FindImplausible(a, b, l), FindImplausible(b, a, l));
  return !FindImplausible(a, b, l);
}

TEST(PlausibilityTest, WhatAVehicleDoes) {
  EXPECT_TRUE(IsPlausible(At(1, 0, 0, 0), At(2, 100, 3, 0)));
  EXPECT_TRUE(IsPlausible(At(1, 0, 0, 0), At(2, 100, 45, 0))) << "behind a tunnel";
  EXPECT_TRUE(IsPlausible(At(1, 0, 0, 0), At(2, 3'600'000, 100'000, 1'500))) << "after a ferry";
  EXPECT_TRUE(IsPlausible(At(1, 0, 0, 0), At(2, 0, 36, 6))) << "a clock of seconds";
  EXPECT_TRUE(IsPlausible(At(1, 5'000, 0, 0), At(2, 4'000, 120, 0))) << "a clock put back";
}

TEST(PlausibilityTest, WhatNoneDoes) {
  EXPECT_EQ(FindImplausible(At(17, 1'000, 0, 0), At(18, 1'100, 812, 0), {}),
            "keyframe 17 to 18: 812 m in 0.10 s, at most 90 m/s and 50 m");
  EXPECT_EQ(FindImplausible(At(18, 1'100, 0, 40), At(17, 1'000, 0, 0), {}),
            "keyframe 17 to 18: 40 m up or down in 0.10 s, at most 15 m/s and 10 m");
  EXPECT_FALSE(IsPlausible(At(1, 0, 0, 0), At(2, 10'000, 951, 0)));
  EXPECT_FALSE(IsPlausible(At(1, 0, 0, 0), At(2, 10'000, 0, -161)));
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
  EXPECT_FALSE(IsPlausible({1, 0, -kMost, 0, 0}, {2, 0, kMost, 0, 0}));
}

TEST(PlausibilityTest, TheBoundsThemselvesArePlausible) {
  EXPECT_TRUE(IsPlausible(At(1, 0, 0, 0), At(2, 10'000, 950, 0)));
  EXPECT_TRUE(IsPlausible(At(1, 0, 0, 0), At(2, 0, 50, 0)));
  EXPECT_FALSE(IsPlausible(At(1, 0, 0, 0), At(2, 0, 51, 0)));
  EXPECT_TRUE(IsPlausible(At(1, 0, 0, 0), At(2, 10'000, 0, 160)));
  EXPECT_TRUE(IsPlausible(At(1, 0, 0, 0), At(2, 0, 0, 10)));
  EXPECT_FALSE(IsPlausible(At(1, 0, 0, 0), At(2, 0, 0, 11)));
}

TEST(PlausibilityTest, ABoundOfZeroIsNone) {
  const UploadedPlace here = At(1, 0, 0, 0);
  EXPECT_TRUE(IsPlausible(here, At(2, 0, 5'000, 0), {0.0, 250.0, 15.0, 20.0}));
  EXPECT_FALSE(IsPlausible(here, At(2, 0, 0, 5'000), {0.0, 250.0, 15.0, 20.0}));
  EXPECT_TRUE(IsPlausible(here, At(2, 0, 0, 100), {90.0, 250.0, 0.0, 20.0}));
  EXPECT_FALSE(IsPlausible(here, At(2, 0, 5'000, 0), {90.0, 250.0, 0.0, 20.0}));
}

}  // namespace
}  // namespace atlas
