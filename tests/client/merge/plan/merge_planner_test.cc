// Merges of simulated drives, end to end: two that drove one street belong together, one from
// elsewhere does not, and what was merged once stays.
#include "client/merge/plan/merge_planner.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <map>
#include <memory>
#include <numbers>
#include <set>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "tests/client/merge/plan/blind_session.h"
#include "tests/client/merge/plan/planned_merge.h"
#include "tests/client/merge/plan/simulated_session.h"

namespace atlas {
namespace {

using testing::AngleBetween;
using testing::At;
using testing::DistanceBetween;
using testing::Merge;
using testing::SimulatedSession;

constexpr double kDegree = std::numbers::pi / 180.0;

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
  again.AddMerged(*merge_, {0, 1});
  again.MustPlan();
  EXPECT_FALSE(again.plan().closures.empty());
  for (const SessionOutcome& outcome : again.plan().sessions) {
    EXPECT_TRUE(outcome.is_joined);
    EXPECT_TRUE(outcome.is_held);
    EXPECT_TRUE(outcome.moved.empty());
    EXPECT_EQ(outcome.max_move_m, 0.0);
  }
}

TEST_F(MergePlannerTest, WhatWasDoneOnceIsRemembered) {
  Merge again(merge_->work());
  again.Add(*first_, false);
  again.Add(*second_, true);
  again.Add(*garage_, true);
  again.MustPlan();
  EXPECT_GT(merge_->reads(), 2 * merge_->keyframes());
  EXPECT_LE(again.reads(), again.keyframes()) << "for the tiles alone";
  ASSERT_EQ(again.plan().closures.size(), merge_->plan().closures.size());
  for (const std::size_t i : {0U, 1U, 2U}) {
    const std::vector<Pose> is = again.After(i);
    const std::vector<Pose> should = merge_->After(i);
    for (std::size_t k = 0; k < is.size(); ++k) {
      EXPECT_EQ(is[k].matrix(), should[k].matrix()) << i << " " << k;
    }
  }
}

// After it was applied, with a session that is new.
TEST_F(MergePlannerTest, OnlyWhatIsNewIsFused) {
  const testing::DrivePiece piece{
      .seed = 4, .first = 50, .count = 48, .drift = DriftOptions{.seed = 7}};
  const SimulatedSession third("third", piece, At(1.0, 0.5));
  Merge later(merge_->work());
  later.AddMerged(*merge_, {0, 1});
  later.Add(third, true);
  later.MustPlan();
  EXPECT_TRUE(later.plan().sessions[0].is_held);
  EXPECT_TRUE(later.plan().sessions[1].is_held);
  EXPECT_TRUE(later.plan().sessions[2].is_joined);
  later.ExpectTrueClosures();
  EXPECT_LT(later.ErrorBetween(2, 0).place_m, 0.05);
  EXPECT_LE(later.reads(), 4 * third.session().keyframes.size());
}

TEST_F(MergePlannerTest, OneThatWasEndedGoesOn) {
  Merge ended;
  ended.Add(*first_, false);
  ended.Add(*second_, true);
  const auto plan = ended.Plan([](std::string_view step, std::size_t, std::size_t) {
    return step == "guided search" ? Status(StatusCode::kUnavailable, "enough") : Status();
  });
  ASSERT_FALSE(plan.has_value());
  Merge again(ended.work());
  again.Add(*first_, false);
  again.Add(*second_, true);
  again.MustPlan();
  again.ExpectTogether(0, 1);
  EXPECT_LE(again.reads(), 3 * again.keyframes()) << "two refinements, and the tiles";
}

// As many wrong ones as right ones, which do not agree with each other.
TEST_F(MergePlannerTest, WrongClosuresAreNotBelieved) {
  Merge merge(merge_->work());
  merge.Add(*first_, false);
  merge.Add(*second_, true);
  std::size_t put = 0;
  merge.MustPlan(
      nullptr, [&](const std::vector<FoundClosure>& found, const std::vector<SessionWay>& ways) {
        std::vector<FoundClosure> wrong;
        for (std::size_t i = 0; i < found.size(); ++i) {
          wrong.push_back(found[i]);
          wrong.back().a.submap = (7 * i + 3) % ways[wrong.back().a.session].way_m.size();
          wrong.back().b.submap = (5 * i + 1) % ways[wrong.back().b.session].way_m.size();
          wrong.back().match.T_a_b.translation().x() += 11.0 + static_cast<double>(i);
          if (!(wrong.back().a < wrong.back().b)) wrong.pop_back();
        }
        put += wrong.size();
        return wrong;
      });
  EXPECT_GT(put, 20U);
  merge.ExpectTrueClosures();
  merge.ExpectTogether(0, 1);
}

// Three places of one session that seem to be three others of it, as its own odometry has these to
// each other: they agree, and all else contradicts them.
TEST_F(MergePlannerTest, ARowOfWrongClosuresIsContradicted) {
  Merge merge(merge_->work());
  merge.Add(*first_, false);
  merge.Add(*second_, true);
  merge.MustPlan(nullptr,
                 [&](const std::vector<FoundClosure>& found, const std::vector<SessionWay>& ways) {
                   const std::vector<Pose>& way = ways[0].T_session_submap;
                   std::vector<FoundClosure> row;
                   for (const std::size_t i : {0U, 1U, 2U}) {
                     row.push_back({{0, i}, {0, i + 4}, found.front().match});
                     row.back().match.T_a_b = (way[0].inverse() * way[i]).inverse() * At(2.0, 1.0) *
                                              (way[4].inverse() * way[i + 4]);
                   }
                   return row;
                 });
  for (const FoundClosure& closure : merge.plan().closures) {
    EXPECT_NE(closure.a.session, closure.b.session);
  }
  EXPECT_GE(merge.plan().rejected, 3U);
  std::size_t listed = 0;
  for (const RejectedClosure& one : merge.plan().rejected_closures) {
    if (one.closure.a.session != one.closure.b.session) continue;
    EXPECT_TRUE(one.is_placed);
    listed += one.off_m > 1.0 ? 1U : 0U;
  }
  EXPECT_GE(listed, 3U) << "each once, however often it was rejected";
  merge.ExpectTrueClosures();
  merge.ExpectTogether(0, 1);
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
