// Every keyframe belongs to one submap, in order; submaps are about as long as they should be.
#include "core/alignment/session_cut.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "tests/core/support/test_scale.h"

namespace atlas {
namespace {

// Along x, at these places.
std::vector<Pose> At(const std::vector<double>& xs_m) {
  std::vector<Pose> poses(xs_m.size(), Pose::Identity());
  for (std::size_t i = 0; i < xs_m.size(); ++i) {
    poses[i].translation().x() = xs_m[i];
  }
  return poses;
}

std::vector<Pose> Straight(std::size_t count, double step_m) {
  std::vector<double> xs_m;
  for (std::size_t i = 0; i < count; ++i) {
    xs_m.push_back(static_cast<double>(i) * step_m);
  }
  return At(xs_m);
}

double StepTo(const std::vector<Pose>& poses, std::size_t i) {
  return (poses[i].translation() - poses[i - 1].translation()).norm();
}

void ExpectEachOnceInOrder(const std::vector<SubmapCut>& cuts, std::size_t keyframes) {
  std::size_t next = 0;
  for (const SubmapCut& cut : cuts) {
    EXPECT_EQ(cut.begin, next);
    EXPECT_LT(cut.begin, cut.end);
    next = cut.end;
  }
  EXPECT_EQ(next, keyframes);
}

TEST(SessionCutTest, NothingMakesNone) {
  EXPECT_TRUE(CutSession({}, {}).empty());
}

TEST(SessionCutTest, OneKeyframeIsASubmap) {
  EXPECT_EQ(CutSession(Straight(1, 1.0), {}), (std::vector<SubmapCut>{{0, 1, false}}));
}

TEST(SessionCutTest, SubmapsShareTheWayEvenly) {
  const std::vector<SubmapCut> cuts = CutSession(Straight(97, 1.0), {});  // 96 m: ten of 9.6
  ASSERT_EQ(cuts.size(), 10U);
  ExpectEachOnceInOrder(cuts, 97);
  for (const SubmapCut& cut : cuts) {
    EXPECT_GE(cut.end - cut.begin, 9U);
    EXPECT_LE(cut.end - cut.begin, 10U);
    EXPECT_FALSE(cut.follows_jump);
  }
}

TEST(SessionCutTest, WhatIsLeftOverMakesNoTinySubmap) {
  EXPECT_EQ(CutSession(Straight(15, 1.0), {}), (std::vector<SubmapCut>{{0, 15, false}}));
  EXPECT_EQ(CutSession(Straight(5, 1.0), {}), (std::vector<SubmapCut>{{0, 5, false}}));
  EXPECT_EQ(CutSession(Straight(17, 1.0), {}),
            (std::vector<SubmapCut>{{0, 9, false}, {9, 17, false}}));
}

// Whatever a third of the way is as a double, three of them are all of it.
TEST(SessionCutTest, TheLastKeyframeIsNotAloneByRounding) {
  for (int i = 0; i < 2'000; ++i) {
    const std::vector<Pose> poses = Straight(80, 0.9 + 1e-4 * i);
    const std::vector<SubmapCut> cuts = CutSession(poses, {});
    ASSERT_GT(cuts.back().end - cuts.back().begin, 2U) << i;
  }
}

TEST(SessionCutTest, AVehicleThatStandsIsCutByCount) {
  const std::vector<SubmapCut> cuts = CutSession(Straight(100, 0.0), {.max_keyframes = 24});
  EXPECT_EQ(
      cuts,
      (std::vector<SubmapCut>{
          {0, 24, false}, {24, 48, false}, {48, 72, false}, {72, 96, false}, {96, 100, false}}));
}

TEST(SessionCutTest, AStopWithinTheWayIsCutByCountAndTheWayGoesOn) {
  std::vector<double> xs_m;
  for (int i = 0; i <= 10; ++i) xs_m.push_back(i);
  xs_m.insert(xs_m.end(), 60, 10.0);
  for (int i = 11; i <= 30; ++i) xs_m.push_back(i);
  const std::vector<SubmapCut> cuts = CutSession(At(xs_m), {});
  ExpectEachOnceInOrder(cuts, xs_m.size());
  for (const SubmapCut& cut : cuts) {
    EXPECT_LE(cut.end - cut.begin, 24U);
    EXPECT_LE(xs_m[cut.end - 1] - xs_m[cut.begin], 10.0);
  }
  EXPECT_EQ(cuts.size(), 5U);
}

TEST(SessionCutTest, AJumpEndsASubmap) {
  const std::vector<SubmapCut> cuts =
      CutSession(At({0.0, 2.0, 4.0, 14.1, 16.0, 16.0, 90.0}), {.jump_m = 10.0});
  EXPECT_EQ(cuts, (std::vector<SubmapCut>{{0, 3, false}, {3, 6, true}, {6, 7, true}}));
}

TEST(SessionCutTest, AStepAsLongAsAJumpMayBeIsNone) {
  EXPECT_EQ(CutSession(At({0.0, 5.0}), {.jump_m = 5.0}), (std::vector<SubmapCut>{{0, 2, false}}));
  EXPECT_EQ(CutSession(At({0.0, 5.0 + 1e-6}), {.jump_m = 5.0}).size(), 2U);
}

// A turn on the spot is no way, and height is.
TEST(SessionCutTest, TheWayIsThatOfTheSensor) {
  std::vector<Pose> ramp(21, Pose::Identity());
  for (std::size_t i = 0; i < ramp.size(); ++i) {
    ramp[i].translation() = Eigen::Vector3d(0.6, 0.0, 0.8) * static_cast<double>(i);
  }
  EXPECT_EQ(CutSession(ramp, {}).size(), 2U);
  std::vector<Pose> turning(20, Pose::Identity());
  for (std::size_t i = 0; i < turning.size(); ++i) {
    turning[i].linear() = Eigen::AngleAxisd(0.3 * static_cast<double>(i), Eigen::Vector3d::UnitZ())
                              .toRotationMatrix();
  }
  EXPECT_EQ(CutSession(turning, {}).size(), 1U);
}

class RandomWay {
 public:
  explicit RandomWay(std::uint32_t seed) : random_(seed) {}

  // Drives, stands, and now and then jumps.
  std::vector<Pose> Make() {
    std::vector<Pose> poses(1 + random_() % 300, Pose::Identity());
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    double heading_rad = 0.0;
    bool is_standing = false;
    for (Pose& pose : poses) {
      pose.translation() = at;
      if (random_() % 20 == 0) is_standing = !is_standing;
      heading_rad += 0.3 * (Draw() - 0.5);
      const double step_m = random_() % 60 == 0 ? 5.0 + 40.0 * Draw() : 2.0 * Draw();
      if (!is_standing) {
        at += step_m * Eigen::Vector3d(std::cos(heading_rad), std::sin(heading_rad), 0.02);
      }
    }
    return poses;
  }

  CutOptions Options() { return {5.0 + 20.0 * Draw(), 2 + random_() % 40, 4.0 + 10.0 * Draw()}; }

 private:
  double Draw() { return static_cast<double>(random_()) / 4294967296.0; }

  std::mt19937 random_;
};

TEST(SessionCutTest, RandomWaysAreCutWhole) {
  for (std::uint32_t seed = 0; seed < testing::Scaled(500); ++seed) {
    SCOPED_TRACE(seed);
    RandomWay random(seed);
    const std::vector<Pose> poses = random.Make();
    const CutOptions options = random.Options();
    const std::vector<SubmapCut> cuts = CutSession(poses, options);
    ExpectEachOnceInOrder(cuts, poses.size());
    std::size_t jumps = 0;
    for (const SubmapCut& cut : cuts) {
      EXPECT_LE(cut.end - cut.begin, options.max_keyframes);
      double way_m = 0.0;
      for (std::size_t i = cut.begin + 1; i < cut.end; ++i) {
        EXPECT_LE(StepTo(poses, i), options.jump_m);
        way_m += StepTo(poses, i);
      }
      EXPECT_LE(way_m, 1.5 * options.length_m);
      EXPECT_EQ(cut.follows_jump, cut.begin > 0 && StepTo(poses, cut.begin) > options.jump_m);
      if (cut.follows_jump) ++jumps;
    }
    std::size_t long_steps = 0;
    for (std::size_t i = 1; i < poses.size(); ++i) {
      if (StepTo(poses, i) > options.jump_m) ++long_steps;
    }
    EXPECT_EQ(jumps, long_steps);
  }
}

}  // namespace
}  // namespace atlas
