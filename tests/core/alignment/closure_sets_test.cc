// True closures agree, wrong ones do not, and wrong ones that agree among themselves are a set of
// their own.
#include "core/alignment/closure_sets.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "tests/core/support/test_scale.h"

namespace atlas {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
using Set = std::vector<std::size_t>;

Pose At(double x_m, double y_m, double z_m = 0.0, double yaw_rad = 0.0) {
  Pose pose = Pose::Identity();
  pose.translation() = Eigen::Vector3d(x_m, y_m, z_m);
  pose.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return pose;
}

// A submap every 10 m along a bend, each turned by another angle.
SessionWay Bend(std::size_t submaps, const Pose& T_session_world) {
  SessionWay way;
  for (std::size_t i = 0; i < submaps; ++i) {
    const double along_m = 10.0 * static_cast<double>(i);
    const double angle_rad = along_m / 80.0;
    way.T_session_submap.push_back(
        T_session_world * At(80.0 * std::sin(angle_rad), 80.0 * (1.0 - std::cos(angle_rad)),
                             0.01 * along_m, 1.7 * static_cast<double>(i)));
    way.way_m.push_back(along_m);
  }
  return way;
}

// Two drives along the same bend, each with a frame of its own.
class TwoDrives {
 public:
  static constexpr std::size_t kSubmaps = 12;

  TwoDrives()
      : T_world_a_(At(300.0, -20.0, 5.0, 0.7)),
        T_world_b_(At(-40.0, 90.0, -2.0, -2.1)),
        a_(Bend(kSubmaps, T_world_a_.inverse())),
        b_(Bend(kSubmaps, T_world_b_.inverse())) {}

  // Where submap `b` lies in `a`, moved by `off` in the frame of a.
  Closure Between(std::size_t a, std::size_t b, const Pose& off = Pose::Identity()) const {
    const Pose T_a_b =
        (T_world_a_ * a_.T_session_submap[a]).inverse() * (T_world_b_ * b_.T_session_submap[b]);
    return {a, b, off * T_a_b, 1.0};
  }
  // As if the whole other session lay elsewhere, by its own map of the world.
  Closure Elsewhere(std::size_t a, std::size_t b, const Pose& T_world_moved) const {
    const Pose T_a_b = (T_world_a_ * a_.T_session_submap[a]).inverse() * T_world_moved *
                       (T_world_b_ * b_.T_session_submap[b]);
    return {a, b, T_a_b, 1.0};
  }

  bool Agree(const Closure& one, const Closure& other) const {
    const bool agree = AreConsistent(one, other, sessions(), {});
    EXPECT_EQ(agree, AreConsistent(other, one, sessions(), {})) << "it is no matter who is asked";
    return agree;
  }
  std::vector<Set> Sets(const std::vector<Closure>& closures, std::size_t most = 2) const {
    return ConsistentSets(closures, sessions(), {}, most);
  }
  SessionPair sessions() const { return {a_, b_}; }
  SessionWay& b() { return b_; }

 private:
  Pose T_world_a_;
  Pose T_world_b_;
  SessionWay a_;
  SessionWay b_;
};

TEST(ClosureSetsTest, TrueClosuresAgree) {
  const TwoDrives drives;
  for (std::size_t i = 0; i < TwoDrives::kSubmaps; ++i) {
    for (std::size_t k = 0; k + 1 < TwoDrives::kSubmaps; ++k) {
      EXPECT_TRUE(drives.Agree(drives.Between(i, i), drives.Between(k, k + 1))) << i << " " << k;
    }
  }
}

TEST(ClosureSetsTest, WhatIsOffByMoreThanDriftDoesNotAgree) {
  const TwoDrives drives;
  const Closure one = drives.Between(3, 3);
  EXPECT_TRUE(drives.Agree(one, drives.Between(4, 4, At(0.4, 0.0))));  // 0.3 m + 1 % of 20 m
  EXPECT_FALSE(drives.Agree(one, drives.Between(4, 4, At(0.6, 0.0))));
  EXPECT_FALSE(drives.Agree(one, drives.Between(4, 4, At(0.0, -0.6))));
  EXPECT_FALSE(drives.Agree(one, drives.Between(4, 4, At(0.0, 0.0, 0.0, kDegree * 180.0))));
}

// Nothing but the turn is wrong: about the other submap's own origin.
TEST(ClosureSetsTest, ATurnOnTheSpotDoesNotAgree) {
  const TwoDrives drives;
  const Closure one = drives.Between(3, 3);
  for (const double yaw_deg : {0.9, 1.4, -0.9, -1.4}) {
    Closure turned = drives.Between(3, 4);
    turned.T_a_b = turned.T_a_b * At(0.0, 0.0, 0.0, yaw_deg * kDegree);
    const bool is_within = std::abs(yaw_deg) < 1.05;  // 1 degree and 0.5 in 100 m, of 10 m
    EXPECT_EQ(AreConsistent(one, turned, drives.sessions(), {.distance_m = 10.0}), is_within)
        << yaw_deg;
  }
  for (const double yaw_deg : {1.7, 1.9}) {
    Closure turned = drives.Between(11, 11);  // 160 m on, in both
    turned.T_a_b = turned.T_a_b * At(0.0, 0.0, 0.0, yaw_deg * kDegree);
    EXPECT_EQ(AreConsistent(one, turned, drives.sessions(), {.distance_m = 10.0}), yaw_deg < 1.8)
        << yaw_deg;
  }
}

// A little turned, one puts the other far off where they are far apart; the other does not.
TEST(ClosureSetsTest, EachPutsTheOthersSubmapWhereItWasFound) {
  const TwoDrives drives;
  const Closure one = drives.Between(0, 0);
  Closure turned = drives.Between(11, 11);
  turned.T_a_b = turned.T_a_b * At(0.0, 0.0, 0.0, 1.9 * kDegree);  // 2.1 may be
  EXPECT_TRUE(drives.Agree(one, drives.Between(11, 11)));
  EXPECT_FALSE(drives.Agree(one, turned));  // 3.3 m, of 2.5
  EXPECT_FALSE(drives.Agree(turned, one));
}

TEST(ClosureSetsTest, AnotherDeckDoesNotAgree) {
  const TwoDrives drives;
  const Closure one = drives.Between(2, 2);
  EXPECT_FALSE(drives.Agree(one, drives.Between(3, 3, At(0.0, 0.0, 3.0))));
  EXPECT_FALSE(drives.Agree(one, drives.Between(11, 11, At(0.0, 0.0, -3.0))));
  EXPECT_TRUE(drives.Agree(one, drives.Between(3, 3, At(0.0, 0.0, 0.25))));
  EXPECT_FALSE(drives.Agree(one, drives.Between(3, 3, At(0.0, 0.0, 0.35))));
}

TEST(ClosureSetsTest, WhatIsToleratedGrowsWithTheWay) {
  const TwoDrives drives;
  const Closure one = drives.Between(0, 0);
  for (std::size_t k = 1; k < TwoDrives::kSubmaps; ++k) {
    const double way_m = 20.0 * static_cast<double>(k);  // both
    const double distance_m = 0.3 + 0.01 * way_m;
    const double height_m = 0.2 + 0.005 * way_m;
    EXPECT_TRUE(drives.Agree(one, drives.Between(k, k, At(0.99 * distance_m, 0.0)))) << k;
    EXPECT_FALSE(drives.Agree(one, drives.Between(k, k, At(1.01 * distance_m, 0.0)))) << k;
    EXPECT_TRUE(drives.Agree(one, drives.Between(k, k, At(0.0, 0.0, 0.99 * height_m)))) << k;
    EXPECT_FALSE(drives.Agree(one, drives.Between(k, k, At(0.0, 0.0, 1.01 * height_m)))) << k;
  }
}

TEST(ClosureSetsTest, OfNothingThereAreNoSets) {
  EXPECT_TRUE(TwoDrives().Sets({}).empty());
  EXPECT_TRUE(TwoDrives().Sets({TwoDrives().Between(1, 1)}, 0).empty());
}

TEST(ClosureSetsTest, OneIsASetOfItsOwn) {
  const TwoDrives drives;
  EXPECT_EQ(drives.Sets({drives.Between(4, 5)}), (std::vector<Set>{{0}}));
}

// What is found may explain no more than it contradicts.
TEST(ClosureSetsTest, WeightlessClosuresAreSetsToo) {
  const TwoDrives drives;
  for (const double weight : {0.0, -0.5}) {
    std::vector<Closure> closures{drives.Between(4, 5), drives.Between(4, 4, At(50.0, 0.0))};
    for (Closure& closure : closures) closure.weight = weight;
    EXPECT_EQ(drives.Sets(closures, 3), (std::vector<Set>{{0}, {1}})) << weight;
  }
}

TEST(ClosureSetsTest, WrongOnesAreLeftOut) {
  const TwoDrives drives;
  const std::vector<Set> sets =
      drives.Sets({drives.Between(0, 0), drives.Between(5, 5, At(8.0, 0.0)), drives.Between(3, 3),
                   drives.Between(7, 7, At(0.0, -5.0)), drives.Between(9, 10)},
                  9);
  EXPECT_EQ(sets, (std::vector<Set>{{0, 2, 4}, {1}, {3}}));
}

TEST(ClosureSetsTest, WrongOnesThatAgreeAreTheRival) {
  const TwoDrives drives;
  const Pose one_bay_on = At(7.5, 0.0);
  const std::vector<Closure> closures{drives.Elsewhere(0, 0, one_bay_on),
                                      drives.Between(1, 1),
                                      drives.Between(4, 4),
                                      drives.Elsewhere(5, 5, one_bay_on),
                                      drives.Between(8, 8),
                                      drives.Elsewhere(9, 9, one_bay_on),
                                      drives.Between(11, 11)};
  EXPECT_EQ(drives.Sets(closures), (std::vector<Set>{{1, 2, 4, 6}, {0, 3, 5}}));
  EXPECT_EQ(drives.Sets(closures, 1), (std::vector<Set>{{1, 2, 4, 6}}));
}

TEST(ClosureSetsTest, WeightCountsNotNumber) {
  const TwoDrives drives;
  const Pose elsewhere = At(20.0, 0.0);
  std::vector<Closure> closures{
      drives.Between(1, 1), drives.Between(4, 4), drives.Elsewhere(2, 2, elsewhere),
      drives.Elsewhere(6, 6, elsewhere), drives.Elsewhere(8, 8, elsewhere)};
  EXPECT_EQ(drives.Sets(closures), (std::vector<Set>{{2, 3, 4}, {0, 1}}));
  closures[0].weight = closures[1].weight = 1.6;
  EXPECT_EQ(drives.Sets(closures), (std::vector<Set>{{0, 1}, {2, 3, 4}}));
}

TEST(ClosureSetsTest, OnlyTheWeightiestAreLookedAt) {
  const TwoDrives drives;
  std::vector<Closure> closures{drives.Between(1, 1), drives.Between(2, 2), drives.Between(3, 3)};
  closures[1].weight = 0.5;
  EXPECT_EQ(ConsistentSets(closures, drives.sessions(), {.max_closures = 2}, 5),
            (std::vector<Set>{{0, 2}}));
}

TEST(ClosureSetsTest, WeightIsThatOfTheSet) {
  std::vector<Closure> closures(3);
  closures[0].weight = 1.0;
  closures[1].weight = 2.0;
  closures[2].weight = 4.0;
  EXPECT_EQ(WeightOf(closures, Set{0, 2}), 5.0);
  EXPECT_EQ(WeightOf(closures, Set{}), 0.0);
}

// True ones with the noise of a match, and wrong ones anywhere, shuffled.
TEST(ClosureSetsTest, AThirdOfWrongOnesDoesNotChangeTheSet) {
  const TwoDrives drives;
  for (std::uint32_t seed = 0; seed < testing::Scaled(100); ++seed) {
    std::mt19937 random(seed);
    const auto draw = [&](double within) {
      return within * (static_cast<double>(random()) / 2147483648.0 - 1.0);
    };
    std::vector<Closure> closures;
    std::vector<bool> is_true;
    for (std::size_t i = 0; i < 30; ++i) {
      is_true.push_back(i % 10 >= 3);
      const std::size_t a = random() % TwoDrives::kSubmaps;
      const std::size_t b = random() % TwoDrives::kSubmaps;
      const Pose off = is_true.back() ? At(draw(0.03), draw(0.03), draw(0.02), 0.0)
                                      : At(draw(1.0) < 0.0 ? -8.0 + draw(6.0) : 8.0 + draw(6.0),
                                           draw(12.0), draw(3.0), draw(0.6));
      closures.push_back(drives.Between(a, b, off));
      closures.back().weight = 0.5 + 0.5 * std::abs(draw(1.0));
    }
    Set expected;
    for (std::size_t i = 0; i < closures.size(); ++i) {
      if (is_true[i]) expected.push_back(i);
    }
    EXPECT_EQ(drives.Sets(closures).front(), expected) << seed;
  }
}

// Sets of any closures: each within itself of one mind, none of the next agrees with one of those
// before, and nothing is in two.
TEST(ClosureSetsTest, SetsKeepTheirPromises) {
  const TwoDrives drives;
  for (std::uint32_t seed = 0; seed < testing::Scaled(100); ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::vector<Closure> closures;
    for (std::size_t i = 0; i < 40; ++i) {
      const double off_m = 0.25 * static_cast<double>(random() % 8);
      closures.push_back(drives.Between(random() % TwoDrives::kSubmaps,
                                        random() % TwoDrives::kSubmaps, At(off_m, 0.0)));
    }
    const auto agree = [&](std::size_t i, std::size_t k) {
      return AreConsistent(closures[std::min(i, k)], closures[std::max(i, k)], drives.sessions(),
                           {});
    };
    Set before;
    for (const Set& set : drives.Sets(closures, 4)) {
      ASSERT_FALSE(set.empty());
      EXPECT_TRUE(std::is_sorted(set.begin(), set.end()));
      for (const std::size_t i : set) {
        for (const std::size_t k : set) EXPECT_TRUE(i == k || agree(i, k)) << i << " " << k;
        for (const std::size_t k : before) EXPECT_FALSE(i == k || agree(i, k)) << i << " " << k;
      }
      before.insert(before.end(), set.begin(), set.end());
    }
  }
}

}  // namespace
}  // namespace atlas
