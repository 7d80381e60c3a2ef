// Keyframes that follow each other: what no vehicle does, and what some do.
#include "core/geometry/plausibility.h"

#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace atlas {
namespace {

constexpr std::int64_t kMetre_um = 1'000'000;
constexpr std::int64_t kHour_ms = 3'600'000;
constexpr std::int64_t kDay_ms = 24 * kHour_ms;

UploadedPlace At(std::uint32_t sequence, std::int64_t time_ms, std::int64_t x_m, std::int64_t z_m) {
  return {sequence, time_ms, x_m * kMetre_um, 0, z_m * kMetre_um};
}

std::optional<ImplausibleWay> Find(const std::vector<UploadedPlace>& places,
                                   const PlausibilityLimits& limits = {}) {
  UploadedTrack track(limits);
  std::optional<ImplausibleWay> found;
  for (auto place = places.begin(); place != places.end() && !found; ++place) {
    found = track.Add(*place);
  }
  return found;
}

bool IsPlausible(const UploadedPlace& a, const UploadedPlace& b, const PlausibilityLimits& l = {}) {
  return !Find({a, b}, l);
}

// Ten keyframes a second along x and z, as functions of the keyframe's number.
std::optional<ImplausibleWay> FindAt10Hz(const std::function<double(int)>& x_m,
                                         const std::function<double(int)>& z_m,
                                         int step_ms = 100) {
  std::vector<UploadedPlace> places;
  for (int i = 0; i < 50; ++i) {
    places.push_back({static_cast<std::uint32_t>(i), std::int64_t{step_ms} * i,
                      std::llround(1e6 * x_m(i)), 0, std::llround(1e6 * z_m(i))});
  }
  return Find(places);
}

double Level(int /*number*/) {
  return 0.0;
}

TEST(PlausibilityTest, WhatAVehicleDoes) {
  EXPECT_TRUE(IsPlausible(At(1, 0, 0, 0), At(2, 100, 3, 0)));
  EXPECT_TRUE(IsPlausible(At(1, 0, 0, 0), At(2, 100, 45, 0))) << "behind a tunnel";
  EXPECT_TRUE(IsPlausible(At(1, 0, 0, 0), At(2, kHour_ms, 100'000, 1'500))) << "after a ferry";
  EXPECT_TRUE(IsPlausible(At(1, 0, 0, 0), At(2, 0, 36, 6))) << "a clock of seconds";
  EXPECT_TRUE(IsPlausible(At(1, 5'000, 0, 0), At(2, 4'000, 120, 0))) << "a clock put back";
  EXPECT_TRUE(IsPlausible(At(1, 0, 0, 0), At(2, 3 * kDay_ms, 40, 3))) << "it stood for a weekend";
  EXPECT_TRUE(IsPlausible(At(1, 0, 0, 0), At(2, 3 * kDay_ms, 300'000, 0))) << "on another's back";
}

TEST(PlausibilityTest, WhatNoneDoes) {
  const auto jump = Find({At(17, 1'000, 0, 0), At(18, 1'100, 812, 0)});
  ASSERT_TRUE(jump);
  EXPECT_EQ(jump->reason, "keyframe 17 to 18: 812 m in 0.10 s, at most 90 m/s and 50 m");
  EXPECT_EQ(jump->from, 17U);
  EXPECT_EQ(jump->to, 18U);
  EXPECT_EQ(Find({At(17, 1'000, 0, 0), At(18, 1'100, 0, 40)})->reason,
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

TEST(PlausibilityTest, MotionThatGoesOnIsFoundWithinASecond) {
  const auto fast = FindAt10Hz([](int i) { return 58.0 * i; }, Level);
  ASSERT_TRUE(fast);
  EXPECT_EQ(fast->reason, "keyframe 0 to 2: 116 m in 0.20 s, at most 90 m/s and 50 m");
  const auto zigzag = FindAt10Hz([](int i) { return 50.0 * (i % 2); }, Level);
  ASSERT_TRUE(zigzag) << "it comes to nothing, and is a way all the same";
  EXPECT_EQ(zigzag->to, 2U);
  const auto climb = FindAt10Hz(Level, [](int i) { return 11.0 * i; });
  ASSERT_TRUE(climb);
  EXPECT_EQ(climb->to, 2U);
  EXPECT_TRUE(FindAt10Hz(Level, [](int i) { return 5.0 * (i % 2); })) << "up and down";
  EXPECT_TRUE(FindAt10Hz([](int i) { return 49.0 * i; }, Level, 0)) << "a clock that stands still";
  const auto slowest = FindAt10Hz([](int i) { return 15.3 * i; }, Level);
  ASSERT_TRUE(slowest);
  EXPECT_EQ(slowest->to, kMostJudgedSteps);
}

TEST(PlausibilityTest, WhatGoesOnInADriveIsPlausible) {
  EXPECT_FALSE(FindAt10Hz([](int i) { return 9.0 * i; }, [](int i) { return 1.5 * i; }));
  const auto after_tunnel = [](int i) {
    return 3.6 * i + (i >= 20 ? 45.0 : 0.0);
  };
  EXPECT_FALSE(FindAt10Hz(after_tunnel, [](int i) { return i < 20 ? 0.0 : 9.0; }));
  EXPECT_FALSE(FindAt10Hz([](int i) { return 5.0 * i; }, Level, 0)) << "no times at all";
  std::vector<UploadedPlace> seconds;  // a clock of whole seconds, 10 Hz on a motorway
  std::vector<UploadedPlace> put_back;
  for (std::uint32_t i = 0; i < 50; ++i) {
    seconds.push_back({i, 1'000 * (i / 10), 3'600'000 * std::int64_t{i}, 0, 0});
    put_back.push_back(
        {i, 1'000 + 100 * std::int64_t{i} - (i < 25 ? 0 : 500), 3'600'000 * std::int64_t{i}, 0, 0});
  }
  EXPECT_FALSE(Find(seconds));
  EXPECT_FALSE(Find(put_back));
}

TEST(PlausibilityTest, NoLeapOfAClockExcusesEveryDistance) {
  const UploadedPlace start = At(1, 0, 0, 0);
  const auto far = Find({start, At(2, 30 * kDay_ms, 5'000'000, 0)});
  ASSERT_TRUE(far);
  EXPECT_EQ(far->reason, "keyframe 1 to 2: 5000000 m in 3600.00 s, at most 90 m/s and 50 m");
  EXPECT_FALSE(IsPlausible(At(1, 30 * kDay_ms, 0, 0), At(2, 0, 5'000'000, 0)));
  EXPECT_FALSE(IsPlausible(start, At(2, 30 * kDay_ms, 0, 60'000)));
  const auto there_and_back =
      Find({start, At(2, 30 * kDay_ms, 1'000, 0), At(3, 200, 0, 0), At(4, 300, 0, 0)});
  ASSERT_TRUE(there_and_back) << "a clock that leaps there and back";
  EXPECT_EQ(there_and_back->to, 3U);
  std::vector<UploadedPlace> parked;  // a keyframe an hour, on a train
  for (std::uint32_t i = 0; i < 24; ++i) {
    parked.push_back(At(i, 2 * kHour_ms * i, 160'000 * std::int64_t{i}, 0));
  }
  EXPECT_FALSE(Find(parked));
}

TEST(PlausibilityTest, WaysAreOfSoManySteps) {
  const auto at_end = [](std::uint32_t between) {
    std::vector<UploadedPlace> places{At(0, 0, 0, 0), At(1, 0, 30, 0)};
    for (std::uint32_t i = 0; i < between; ++i) {
      places.push_back(At(2 + i, 0, 30, 0));
    }
    places.push_back(At(2 + between, 0, 60, 0));
    return Find(places);
  };
  EXPECT_TRUE(at_end(kMostJudgedSteps - 2));
  EXPECT_FALSE(at_end(kMostJudgedSteps - 1));
}

TEST(PlausibilityTest, NoWayLeadsOverABreak) {
  UploadedTrack track({});
  EXPECT_FALSE(track.Add(At(1, 0, 0, 0)));
  track.Break();
  EXPECT_FALSE(track.Add(At(2, 0, 500, 0)));
  EXPECT_TRUE(track.Add(At(3, 0, 0, 0)));
}

}  // namespace
}  // namespace atlas
