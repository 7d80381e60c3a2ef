// The ground along single rays, return by return.
#include "core/grid/ground_profile.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "tests/core/support/shape_world.h"

namespace atlas {
namespace {

using testing::AddReturn;

constexpr float kHeight_m = 1.8F;
const VehicleContact kContact{Eigen::Vector3f::UnitZ(), kHeight_m};

// A drawing of one ray: returns at growing ranges, all straight ahead.
struct Drawn {
  float range_m;
  float z_m;
  bool is_ground;
};

class GroundProfileTest : public ::testing::Test {
 protected:
  // In the middle of ray 0.
  LeveledScan OneRay(std::initializer_list<Drawn> returns) const {
    LeveledScan scan;
    const float azimuth_rad = 0.5F * rays_.ray_width_rad();
    for (const Drawn& r : returns) {
      AddReturn(scan, {r.range_m * std::cos(azimuth_rad), r.range_m * std::sin(azimuth_rad), r.z_m},
                r.is_ground);
    }
    return scan;
  }

  GroundProfiles Build(const LeveledScan& scan) const { return {scan, rays_, kContact, options_}; }

  // Ranges of ray 0's ground beyond the vehicle's own, rounded to decimetres.
  std::vector<int> GroundRanges(std::initializer_list<Drawn> returns) const {
    const GroundProfiles profiles = Build(OneRay(returns));
    std::vector<int> ranges_dm;
    for (const GroundSample& sample : profiles.Ray(0).ground.subspan(2)) {
      ranges_dm.push_back(static_cast<int>(std::lround(10.0F * sample.range_m)));
    }
    return ranges_dm;
  }

  RayEnd End(std::initializer_list<Drawn> returns) const {
    return Build(OneRay(returns)).Ray(0).end;
  }

  // Negative: none.
  float ObstacleRange(std::initializer_list<Drawn> returns) const {
    const RayEnd end = End(returns);
    return end.is_obstacle ? end.range_m : -1.0F;
  }

  // Whether the ground is known between the last two samples.
  bool IsLastJoined(std::initializer_list<Drawn> returns) const {
    return Build(OneRay(returns)).Ray(0).ground.back().is_joined;
  }
  // The same of the last but one.
  bool IsLastButOneJoined(std::initializer_list<Drawn> returns) const {
    const GroundProfiles profiles = Build(OneRay(returns));
    return std::prev(profiles.Ray(0).ground.end(), 2)->is_joined;
  }

  RayTable rays_{GridGeometry{100'000, 200}};
  ProfileOptions options_;
};

TEST_F(GroundProfileTest, BeginsBelowTheVehicle) {
  const VehicleContact tilted{Eigen::Vector3f(-0.1F, 0.2F, 1.0F).normalized(), kHeight_m};
  const GroundProfiles profiles(LeveledScan(), rays_, tilted, options_);
  for (int ray = 0; ray < rays_.rays(); ray += 13) {
    const RayProfile profile = profiles.Ray(ray);
    ASSERT_EQ(profile.ground.size(), 2U);
    EXPECT_EQ(profile.ground[0].range_m, 0.0F);
    EXPECT_EQ(profile.ground[0].z_m, -kHeight_m);
    const double azimuth = (ray + 0.5) * static_cast<double>(rays_.ray_width_rad());
    EXPECT_EQ(profile.ground[1].range_m, options_.contact_radius_m);
    EXPECT_NEAR(profile.ground[1].z_m,
                -kHeight_m + 1.5 * (0.1 * std::cos(azimuth) - 0.2 * std::sin(azimuth)), 1e-4);
    EXPECT_FALSE(profile.end.is_obstacle);
    EXPECT_EQ(profile.end.range_m, options_.contact_radius_m);
    EXPECT_EQ(profile.farthest_m, 0.0F);
  }
}

TEST_F(GroundProfileTest, GroundIsWhatCanBeReachedFromTheGroundBefore) {
  // A roof 1.3 m up that segmentation took for ground, and the ground behind it.
  EXPECT_EQ(
      GroundRanges({{5, -1.8F, true}, {7, -0.5F, true}, {7.2F, -0.5F, true}, {12, -1.8F, true}}),
      (std::vector<int>{50, 120}));
  // A slope of 0.4 is climbed, one of 0.6 is not.
  EXPECT_EQ(GroundRanges({{4, -0.8F, true}, {8, 0.8F, true}}), (std::vector<int>{40, 80}));
  EXPECT_EQ(GroundRanges({{4, -1.8F, true}, {8, 0.6F, true}}), (std::vector<int>{40}));
  // The same downwards.
  EXPECT_EQ(GroundRanges({{4, -2.8F, true}, {8, -4.4F, true}}), (std::vector<int>{40, 80}));
  EXPECT_EQ(GroundRanges({{4, -1.8F, true}, {8, -4.2F, true}}), (std::vector<int>{40}));
  // A kerb of 0.2 m within 0.1 m of way is a step, one of 0.35 m is none.
  EXPECT_EQ(GroundRanges({{5, -1.8F, true}, {5.1F, -1.6F, true}}), (std::vector<int>{50, 51}));
  EXPECT_EQ(GroundRanges({{5, -1.8F, true}, {5.1F, -1.45F, true}}), (std::vector<int>{50}));
}

TEST_F(GroundProfileTest, WhatIsHigherThanAStepMustBeOnASlopeThatShows) {
  // A bonnet 0.9 m up beside a level street is near enough to the slope limit, and level.
  EXPECT_EQ(GroundRanges({{5, -1.8F, true}, {7, -0.9F, true}, {8, -0.9F, true}, {12, -1.8F, true}}),
            (std::vector<int>{50, 120}));
  // The same where it is all there is, and where it ends in a windscreen.
  EXPECT_TRUE(GroundRanges({{4.7F, -0.9F, true}, {4.9F, -0.9F, true}}).empty());
  EXPECT_TRUE(
      GroundRanges({{4.7F, -0.9F, true}, {6.4F, -0.85F, true}, {6.5F, -0.5F, true}}).empty());
  // A bonnet, a windscreen and a roof: together steep as a ramp, and no line.
  EXPECT_TRUE(GroundRanges({{4.3F, -0.9F, true},
                            {4.9F, -0.88F, true},
                            {5.3F, -0.55F, false},
                            {5.8F, -0.3F, true},
                            {6.2F, -0.3F, true}})
                  .empty());
  // A rail 0.9 m up, one return wide.
  EXPECT_EQ(GroundRanges({{5, -1.8F, true}, {9, -0.9F, true}}), (std::vector<int>{50}));
  // Ramps of 18.5 degrees: first seen behind a gap, up to a crest, and behind a crest.
  EXPECT_EQ(GroundRanges({{5, -1.8F, true}, {8, -0.8F, true}, {9.5F, -0.3F, true}}),
            (std::vector<int>{50, 80, 95}));
  EXPECT_EQ(GroundRanges({{3, -1.3F, true}, {6, -0.3F, true}, {9, 0.0F, true}, {14, 0.0F, true}}),
            (std::vector<int>{30, 60, 90, 140}));
  // A ramp below a ceiling, bumpy by a hand's breadth.
  EXPECT_EQ(GroundRanges({{4, -1.0F, true},
                          {4.5F, 2.2F, false},
                          {5, -0.55F, true},
                          {6, -0.33F, true},
                          {8, 0.33F, true}}),
            (std::vector<int>{40, 50, 60, 80}));
  EXPECT_EQ(GroundRanges({{5, -1.8F, true}, {8, -2.8F, true}, {12, -4.1F, true}}),
            (std::vector<int>{50, 80, 120}));
  // A kerb, a lawn 0.1 m up.
  EXPECT_EQ(GroundRanges({{5, -1.8F, true}, {5.1F, -1.68F, true}, {9, -1.68F, true}}),
            (std::vector<int>{50, 51, 90}));
  EXPECT_EQ(GroundRanges({{5, -1.8F, true}, {8, -1.7F, true}, {12, -1.7F, true}}),
            (std::vector<int>{50, 80, 120}));
}

TEST_F(GroundProfileTest, AtTheFootOfARampTheFloorIsNoHigherThanWhatWasDriven) {
  // The wheels' plane goes on below the floor ahead, which lies where the vehicle itself is.
  const VehicleContact down{Eigen::Vector3f(0.3F, 0, 1.0F).normalized(), kHeight_m};
  const LeveledScan scan = OneRay({{4, -1.85F, true}, {9, -1.85F, true}});
  const GroundProfiles profiles(scan, rays_, down, options_);
  EXPECT_EQ(profiles.Ray(0).ground.size(), 4U);
  // The floor on both sides of a dip.
  EXPECT_EQ(GroundRanges({{5, -1.8F, true}, {7, -2.3F, true}, {9, -1.8F, true}}),
            (std::vector<int>{50, 70, 90}));
}

TEST_F(GroundProfileTest, GroundUnderTheVehicleIsNotTakenFromReturns) {
  EXPECT_TRUE(GroundRanges({{1.2F, -1.2F, true}, {1.45F, -1.7F, true}}).empty());
}

TEST_F(GroundProfileTest, TheNearestObstacleEndsTheRay) {
  EXPECT_FLOAT_EQ(ObstacleRange({{5, -1.8F, true}, {9, -0.5F, false}, {7, -1.0F, false}}), 7.0F);
  const GroundProfiles profiles =
      Build(OneRay({{5, -1.8F, true}, {7, -1.0F, false}, {12, -1.8F, true}}));
  EXPECT_FLOAT_EQ(profiles.Ray(0).end.range_m, 7.0F);
  EXPECT_FLOAT_EQ(profiles.Ray(0).farthest_m, 12.0F);
  EXPECT_EQ(profiles.Ray(0).ground.size(), 4U);  // the ground behind is known all the same
}

TEST_F(GroundProfileTest, AVehiclePassesBelowWhatHangsHigherThanItsClearance) {
  EXPECT_FLOAT_EQ(ObstacleRange({{6, -1.8F, true}, {10, 0.65F, false}}), 10.0F);
  EXPECT_LT(ObstacleRange({{6, -1.8F, true}, {10, 0.75F, false}}), 0.0F);
  EXPECT_FLOAT_EQ(ObstacleRange({{6, -1.8F, true}, {7, 0.9F, false}, {10, 0.5F, false}}), 10.0F);
}

TEST_F(GroundProfileTest, ClearanceCountsFromTheGroundBelowAndNotFromTheVehicle) {
  // Up a ramp of 0.2 from 2 m on: 2 m above the ramp stands in the way, 3 m does not.
  const Drawn foot{2, -1.8F, true};
  const Drawn ramp_a{6, -1.0F, true};
  const Drawn ramp_b{12, 0.2F, true};
  EXPECT_FLOAT_EQ(ObstacleRange({foot, ramp_a, ramp_b, {7, -0.8F + 2.4F, false}}), 7.0F);
  EXPECT_LT(ObstacleRange({foot, ramp_a, ramp_b, {7, -0.8F + 2.6F, false}}), 0.0F);
  // Beyond the last ground its height goes on.
  EXPECT_FLOAT_EQ(ObstacleRange({foot, ramp_a, ramp_b, {15, 0.2F + 2.4F, false}}), 15.0F);
  EXPECT_LT(ObstacleRange({foot, ramp_a, ramp_b, {15, 0.2F + 2.6F, false}}), 0.0F);
}

TEST_F(GroundProfileTest, WhatIsBelowTheGroundIsAnObstacle) {
  // A hole's far wall, or the edge of a deck: no vehicle passes there.
  EXPECT_FLOAT_EQ(ObstacleRange({{5, -1.8F, true}, {8, -2.6F, false}}), 8.0F);
}

TEST_F(GroundProfileTest, ATopThatCannotBeReachedEndsTheRayAndIsNoObstacle) {
  // The flat top of a parapet, taken for ground, before a ramp and a floor beyond it.
  const RayEnd end = End({{2, -0.4F, true}, {7, -1.8F, true}, {12, -1.8F, true}});
  EXPECT_FLOAT_EQ(end.range_m, 2.0F);
  EXPECT_FALSE(end.is_obstacle);
  // A kerb that is climbed ends nothing; what hangs higher than the vehicle does not, either.
  EXPECT_FLOAT_EQ(End({{5, -1.8F, true}, {5.1F, -1.6F, true}, {9, -1.6F, true}}).range_m, 9.0F);
  EXPECT_FLOAT_EQ(End({{5, -1.8F, true}, {6, 0.8F, true}, {9, -1.8F, true}}).range_m, 9.0F);
}

TEST_F(GroundProfileTest, StraightGroundIsKnownBetweenItsReturns) {
  EXPECT_TRUE(IsLastJoined({{7, -1.8F, true}}));
  EXPECT_TRUE(IsLastJoined({{5, -0.8F, true}, {6, -0.5F, true}, {9, 0.4F, true}}));  // a ramp
  EXPECT_TRUE(IsLastJoined({{5, -1.8F, true}, {6, -1.8F, true}, {9, -1.6F, true}}));
  // Two centimetres of noise within a decimetre are no slope to go on with.
  EXPECT_TRUE(IsLastJoined({{6.9F, -1.82F, true}, {7, -1.8F, true}, {10, -1.8F, true}}));
}

TEST_F(GroundProfileTest, BeyondABendTheGroundIsAGuess) {
  EXPECT_FALSE(IsLastButOneJoined(
      {{5, -1.8F, true}, {6, -1.8F, true}, {9, -1.5F, true}, {11, -1.3F, true}}));
  EXPECT_FALSE(IsLastJoined({{5, -1.8F, true}, {6, -1.8F, true}, {9, -2.7F, true}}));
}

TEST_F(GroundProfileTest, WhereARayPassedBelowTheChordThereIsNoGround) {
  // A floor on both sides of a hole: one ray meets the bottom of it, or a wall far beyond.
  EXPECT_TRUE(IsLastJoined({{5, -1.8F, true}, {12, -1.8F, true}}));
  EXPECT_FALSE(IsLastJoined({{5, -1.8F, true}, {9, -3.1F, true}, {12, -1.8F, true}}));
  EXPECT_FALSE(IsLastJoined({{5, -1.8F, true}, {12, -1.8F, true}, {18, -3.6F, false}}));
  // Rays that end before the gap, or pass above it, say nothing.
  EXPECT_TRUE(IsLastJoined({{4.9F, -2.2F, false}, {5, -1.8F, true}, {12, -1.8F, true}}));
  EXPECT_TRUE(IsLastJoined({{5, -1.8F, true}, {12, -1.8F, true}, {18, -2.4F, false}}));
}

TEST_F(GroundProfileTest, ReturnsBeyondTheRadiusAreNotOnTheGrid) {
  EXPECT_TRUE(GroundRanges({{20.0F, -1.8F, true}, {25, -1.8F, true}}).empty());
  EXPECT_LT(ObstacleRange({{20.1F, -1.0F, false}}), 0.0F);
  EXPECT_EQ(Build(OneRay({{20.1F, -1.0F, false}})).Ray(0).farthest_m, 0.0F);
}

TEST_F(GroundProfileTest, AReturnStandsForEveryRayBetweenItAndItsNeighbours) {
  const float width_rad = rays_.ray_width_rad();
  for (const int middle : {0, 3, rays_.rays() / 2, rays_.rays() - 1}) {
    LeveledScan scan;
    const float azimuth_rad = (static_cast<float>(middle) + 0.5F) * width_rad;
    AddReturn(scan, {8.0F * std::cos(azimuth_rad), 8.0F * std::sin(azimuth_rad), -1.0F}, false);
    scan.column_spacing_rad = 4.0F * width_rad;  // two rays either way
    const GroundProfiles profiles = Build(scan);
    for (int ray = 0; ray < rays_.rays(); ++ray) {
      const int turns = std::abs(ray - middle);
      const int away = std::min(turns, rays_.rays() - turns);
      EXPECT_EQ(profiles.Ray(ray).end.is_obstacle, away <= 2) << middle << " " << ray;
    }
  }
}

TEST_F(GroundProfileTest, TheOrderOfReturnsDoesNotMatter) {
  std::mt19937 random(71);
  std::uniform_real_distribution<float> coordinate(-22.0F, 22.0F);
  std::uniform_real_distribution<float> height(-2.2F, 1.5F);
  for (int round = 0; round < 5; ++round) {
    std::vector<std::pair<Eigen::Vector3f, bool>> returns;
    for (int i = 0; i < 5000; ++i) {
      returns.emplace_back(Eigen::Vector3f(coordinate(random), coordinate(random), height(random)),
                           random() % 2 == 0);
    }
    const auto scan_of = [&returns] {
      LeveledScan scan;
      for (const auto& [p, is_ground] : returns) {
        AddReturn(scan, p, is_ground);
      }
      scan.column_spacing_rad = 0.01F;
      return scan;
    };
    const GroundProfiles first = Build(scan_of());
    std::shuffle(returns.begin(), returns.end(), random);
    const GroundProfiles second = Build(scan_of());
    for (int ray = 0; ray < rays_.rays(); ++ray) {
      const RayProfile a = first.Ray(ray);
      const RayProfile b = second.Ray(ray);
      EXPECT_EQ(a.end.range_m, b.end.range_m);
      EXPECT_EQ(a.end.is_obstacle, b.end.is_obstacle);
      EXPECT_EQ(a.farthest_m, b.farthest_m);
      ASSERT_TRUE(std::equal(a.ground.begin(), a.ground.end(), b.ground.begin(), b.ground.end(),
                             [](const GroundSample& s, const GroundSample& t) {
                               return s.range_m == t.range_m && s.z_m == t.z_m &&
                                      s.is_joined == t.is_joined;
                             }));
      EXPECT_TRUE(std::is_sorted(a.ground.begin(), a.ground.end(),
                                 [](const GroundSample& s, const GroundSample& t) {
                                   return s.range_m <= t.range_m;  // strictly growing
                                 }));
    }
  }
}

TEST_F(GroundProfileTest, GridsOfAFewCellsWork) {
  for (const std::int32_t radius : {1, 2, 3}) {
    const RayTable rays(GridGeometry{1'000'000, radius});
    LeveledScan scan;
    AddReturn(scan, {0.9F, 0.1F, -1.0F}, false);
    scan.column_spacing_rad = 0.1F;
    const GroundProfiles profiles(scan, rays, kContact, options_);
    EXPECT_NEAR(profiles.Ray(0).end.range_m, std::hypot(0.9F, 0.1F), 1e-5F);
  }
}

}  // namespace
}  // namespace atlas
