// Merges of simulated drives, end to end: two that drove one street belong together, one from
// elsewhere does not, and what was merged once stays.
#include "client/merge/plan/merge_planner.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <set>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "tests/client/merge/plan/blind_session.h"
#include "tests/client/merge/plan/simulated_session.h"

namespace atlas {
namespace {

using testing::AngleBetween;
using testing::At;
using testing::DistanceBetween;
using testing::SimulatedSession;

constexpr double kDegree = std::numbers::pi / 180.0;

// A merge of some of the drives, in some order; its results by the drive.
class Merge {
 public:
  void Add(const SimulatedSession& drive, bool is_staged) {
    drives_.push_back(&drive);
    sessions_.push_back(drive.session());
    sessions_.back().is_staged = is_staged;
    readers_.push_back(drive.reader());
  }

  Result<MergePlan> Plan(const MergeProgress& progress = nullptr) {
    return PlanMerge(sessions_, readers_, {MapProfile(), options_, work_}, progress);
  }
  void MustPlan(const MergeProgress& progress = nullptr) {
    auto plan = Plan(progress);
    ASSERT_TRUE(plan.has_value()) << plan.error().message();
    plan_ = *std::move(plan);
    ASSERT_EQ(plan_.sessions.size(), sessions_.size());
  }

  const MergePlan& plan() const { return plan_; }
  MergeOptions& options() { return options_; }
  std::vector<MergeSession>& sessions() { return sessions_; }
  std::vector<BlobReader>& readers() { return readers_; }

  // As the poses of session `i` would be stored afterwards; as they are where nothing was planned.
  std::vector<Pose> After(std::size_t i) const {
    std::vector<Pose> poses = StoredPoses(sessions_[i]);
    if (plan_.sessions.empty()) return poses;
    for (const MovedKeyframe& moved : plan_.sessions[i].moved) {
      poses[moved.keyframe] = moved.T_world_sensor.ToPose();
    }
    return poses;
  }

  // Of keyframes of `a` and the nearest of `b`, as far as those are near: from where they truly lie
  // to each other, root mean square.
  struct Error {
    double place_m = 0.0;
    double turn_rad = 0.0;
    int pairs = 0;
  };
  Error ErrorBetween(std::size_t a, std::size_t b, double near_m = 3.0) const {
    const std::vector<Pose> of_a = After(a);
    const std::vector<Pose> of_b = After(b);
    Error error;
    for (std::size_t i = 0; i < of_a.size(); ++i) {
      const Pose& T_world_a = drives_[a]->truth()[i];
      const std::vector<Pose>& others = drives_[b]->truth();
      const auto nearest =
          std::min_element(others.begin(), others.end(), [&](const Pose& one, const Pose& other) {
            return DistanceBetween(one, T_world_a) < DistanceBetween(other, T_world_a);
          });
      if (DistanceBetween(*nearest, T_world_a) > near_m) continue;
      const Pose is = of_a[i].inverse() * of_b[static_cast<std::size_t>(nearest - others.begin())];
      const Pose should = T_world_a.inverse() * *nearest;
      error.place_m += std::pow(DistanceBetween(is, should), 2);
      error.turn_rad += std::pow(AngleBetween(is, should), 2);
      ++error.pairs;
    }
    error.place_m = std::sqrt(error.place_m / std::max(1, error.pairs));
    error.turn_rad = std::sqrt(error.turn_rad / std::max(1, error.pairs));
    return error;
  }

  void ExpectTogether(std::size_t a, std::size_t b) const {
    const Error error = ErrorBetween(a, b);
    EXPECT_GT(error.pairs, 30);
    EXPECT_LT(error.place_m, 0.05);
    EXPECT_LT(error.turn_rad, 0.1 * kDegree);
  }

  void ExpectTrueClosures() const {
    ASSERT_FALSE(plan_.closures.empty());
    ASSERT_EQ(plan_.closure_off_m.size(), plan_.closures.size());
    for (std::size_t i = 0; i < plan_.closures.size(); ++i) {
      const FoundClosure& closure = plan_.closures[i];
      const auto truth_of = [&](const SubmapRef& ref) {
        return drives_[ref.session]->TruthOf(sessions_[ref.session], ref.submap);
      };
      const Pose should = truth_of(closure.a).inverse() * truth_of(closure.b);
      EXPECT_LT(DistanceBetween(closure.match.T_a_b, should), 0.15);
      EXPECT_LT(AngleBetween(closure.match.T_a_b, should), 0.6 * kDegree);
      EXPECT_LT(plan_.closure_off_m[i], 0.1);
      EXPECT_LT(plan_.closure_off_rad[i], 0.3 * kDegree);
    }
  }

  void ExpectApart(std::size_t i) const {
    const SessionOutcome& outcome = plan_.sessions[i];
    EXPECT_FALSE(outcome.is_joined);
    EXPECT_FALSE(outcome.is_held);
    EXPECT_TRUE(outcome.moved.empty());
    EXPECT_EQ(outcome.max_move_m, 0.0);
    for (const FoundClosure& closure : plan_.closures) {
      EXPECT_TRUE(closure.a.session != i || closure.b.session != i);
      EXPECT_EQ(closure.a.session == i, closure.b.session == i);
    }
  }

 private:
  std::vector<const SimulatedSession*> drives_;
  std::vector<MergeSession> sessions_;
  std::vector<BlobReader> readers_;
  MergeOptions options_;
  MergeWork work_ = MergeWork::Temporary().value();
  MergePlan plan_;
};

// What is driven, and merged for the first time, is once for all tests.
class MergePlannerTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    first_ = std::make_unique<SimulatedSession>(
        "first",
        testing::DrivePiece{.seed = 0, .first = 30, .count = 64, .drift = DriftOptions{.seed = 5}});
    second_ = std::make_unique<SimulatedSession>(
        "second",
        testing::DrivePiece{.seed = 2, .first = 40, .count = 64, .drift = DriftOptions{.seed = 6}},
        At(300.0, -80.0, 12.0, 2.0));
    garage_ = std::make_unique<SimulatedSession>(
        "garage",
        testing::DrivePiece{
            .world = WorldKind::kGarage, .first = 70, .count = 24, .drift = DriftOptions{}},
        At(60.0, 0.0));
    merge_ = std::make_unique<Merge>();
    merge_->Add(*first_, false);
    merge_->Add(*second_, true);
    merge_->Add(*garage_, true);
    merge_->MustPlan([](std::string_view step, std::size_t done, std::size_t all) {
      EXPECT_LE(done, all);
      EXPECT_GE(done, 1U);
      steps_.emplace(step);
      return Status();
    });
  }
  static void TearDownTestSuite() {
    merge_.reset();
    first_.reset();
    second_.reset();
    garage_.reset();
  }

  inline static std::unique_ptr<SimulatedSession> first_;
  inline static std::unique_ptr<SimulatedSession> second_;
  inline static std::unique_ptr<SimulatedSession> garage_;
  inline static std::unique_ptr<Merge> merge_;  // of these, the first one in the map
  inline static std::set<std::string> steps_;   // that it told of
};

TEST_F(MergePlannerTest, DrivesOfOneStreetAreJoined) {
  const MergePlan& plan = merge_->plan();
  EXPECT_TRUE(plan.sessions[0].is_joined);
  EXPECT_TRUE(plan.sessions[1].is_joined);
  EXPECT_EQ(plan.sessions[1].moved.size(), 64U);
  EXPECT_GT(plan.sessions[1].rms_move_m, 100.0);
  EXPECT_LT(plan.sessions[0].max_move_m, 2.0);
  EXPECT_EQ(plan.sessions[0].submaps, merge_->sessions()[0].submaps.size());
  EXPECT_GE(plan.sessions[1].submaps_met, 6U);
  EXPECT_GE(plan.closures.size(), 9U);  // of the guided search and of what it began with
  EXPECT_GE(plan.sessions[1].closures, plan.sessions[1].submaps_met);
  merge_->ExpectTogether(0, 1);
  merge_->ExpectTrueClosures();
}

TEST_F(MergePlannerTest, WhatIsFromElsewhereStaysApart) {
  merge_->ExpectApart(2);
}

TEST_F(MergePlannerTest, WhatWasMergedStays) {
  Merge again;
  again.Add(*first_, false);
  again.Add(*second_, false);
  for (const std::size_t i : {0U, 1U}) {
    const std::vector<Pose> after = merge_->After(i);
    for (std::size_t k = 0; k < after.size(); ++k) {
      again.sessions()[i].keyframes[k].T_world_sensor = QuantizedPose::FromPose(after[k]);
    }
  }
  again.MustPlan();
  EXPECT_FALSE(again.plan().closures.empty());
  for (const SessionOutcome& outcome : again.plan().sessions) {
    EXPECT_TRUE(outcome.is_joined);
    EXPECT_TRUE(outcome.is_held);
    EXPECT_TRUE(outcome.moved.empty());
    EXPECT_EQ(outcome.max_move_m, 0.0);
  }
}

// Beyond what registrations that begin elsewhere end apart.
TEST_F(MergePlannerTest, TheOrderOfSessionsDoesNotMatter) {
  Merge other;
  other.Add(*garage_, true);
  other.Add(*second_, true);
  other.Add(*first_, false);
  other.MustPlan();
  other.ExpectTogether(2, 1);
  other.ExpectTrueClosures();
  other.ExpectApart(0);
  EXPECT_EQ(other.plan().sessions[2].is_held, merge_->plan().sessions[0].is_held);
  for (const std::size_t session : {0U, 1U}) {
    const std::vector<Pose> is = other.After(2 - session);
    const std::vector<Pose> should = merge_->After(session);
    for (std::size_t k = 0; k < is.size(); ++k) {
      EXPECT_LT(DistanceBetween(is[k], should[k]), 0.01) << session << " " << k;
      EXPECT_LT(AngleBetween(is[k], should[k]), 0.02 * kDegree) << session << " " << k;
    }
  }
}

TEST_F(MergePlannerTest, WhereNoneIsInTheMapMostOfThemAreIt) {
  Merge merge;
  merge.Add(*garage_, true);
  merge.Add(*first_, true);
  merge.Add(*second_, true);
  merge.options().guided_rounds = 0;
  merge.options().refinements = 0;
  merge.MustPlan();
  merge.ExpectApart(0);
  EXPECT_TRUE(merge.plan().sessions[1].is_joined);
  EXPECT_TRUE(merge.plan().sessions[2].is_joined);
  EXPECT_LT(merge.ErrorBetween(1, 2).place_m, 0.5);
}

TEST_F(MergePlannerTest, ProgressIsToldOfEachStep) {
  EXPECT_EQ(steps_, (std::set<std::string>{"submaps", "odometry", "search", "guided search",
                                           "closures again"}));
}

TEST_F(MergePlannerTest, ProgressThatFailsEndsIt) {
  Merge merge;
  merge.Add(*first_, false);
  for (const std::string_view last : {"submaps", "odometry"}) {
    const auto plan = merge.Plan([&](std::string_view step, std::size_t, std::size_t) {
      return step == last ? Status(StatusCode::kUnavailable, "enough") : Status();
    });
    ASSERT_FALSE(plan.has_value()) << last;
    EXPECT_EQ(plan.error(), Status(StatusCode::kUnavailable, "enough"));
  }
}

TEST_F(MergePlannerTest, ADamagedKeyframeIsNamed) {
  Merge merge;
  merge.Add(*first_, false);
  const BlobReader whole = merge.readers()[0];
  merge.readers()[0] = [&](std::size_t i) -> Result<Bytes> {
    Result<Bytes> blob = whole(i);
    if (i == 41) (*blob)[blob->size() / 2] ^= 0x01;
    return blob;
  };
  const auto plan = merge.Plan();
  ASSERT_FALSE(plan.has_value());
  EXPECT_EQ(plan.error().code(), StatusCode::kInvalidData);
  EXPECT_NE(plan.error().message().find("keyframe first/drive/71"), std::string::npos)
      << plan.error().message();
}

TEST(EmptyMergeTest, OfNothingIsNothing) {
  Merge merge;
  merge.MustPlan();
  EXPECT_TRUE(merge.plan().closures.empty());
}

// In the map and not: neither has anywhere to go, and no number is none.
TEST(EmptyMergeTest, SessionsWithoutKeyframesAreNoMatter) {
  for (const bool is_staged : {false, true}) {
    std::vector<MergeSession> sessions(2);
    for (MergeSession& session : sessions) session.is_staged = is_staged;
    const auto none = [](std::size_t) -> Result<Bytes> {
      return Bytes();
    };
    const auto plan = PlanMerge(sessions, {none, none},
                                {MapProfile(), MergeOptions(), testing::SharedWork()}, nullptr);
    ASSERT_TRUE(plan.has_value());
    for (const SessionOutcome& outcome : plan->sessions) {
      EXPECT_TRUE(outcome.moved.empty());
      EXPECT_EQ(outcome.rms_move_m, 0.0);
    }
  }
}

}  // namespace
}  // namespace atlas
