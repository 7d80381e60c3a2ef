// Matching keeps what it prepared, which changes no answer.
#include "client/merge/plan/match_worker.h"

#include <memory>
#include <numbers>

#include <gtest/gtest.h>

#include "client/merge/plan/submap_builder.h"
#include "tests/client/merge/plan/blind_session.h"
#include "tests/client/merge/plan/simulated_session.h"

namespace atlas {
namespace {

using testing::AngleBetween;
using testing::At;
using testing::DistanceBetween;
using testing::SimulatedSession;

constexpr double kDegree = std::numbers::pi / 180.0;

class MatchWorkerTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    drive_ = std::make_unique<SimulatedSession>(
        "car", testing::DrivePiece{.first = 30, .count = 33, .drift = std::nullopt});
    sessions_.push_back(drive_->session());
    // Many short ones, more than are kept.
    MergeOptions options;
    options.cut.length_m = 1.5;
    sessions_.push_back(drive_->session());
    for (std::size_t i = 0; i < sessions_.size(); ++i) {
      const Status built = BuildSubmaps(
          sessions_[i], StoredPoses(sessions_[i]), drive_->reader(),
          {MapProfile(), i == 0 ? MergeOptions() : options, testing::SharedWork()}, {}, nullptr);
      ASSERT_TRUE(built.ok()) << built.message();
    }
    ASSERT_GE(sessions_[0].submaps.size(), 3U);
    ASSERT_GE(sessions_[1].submaps.size(), 12U);
  }
  static void TearDownTestSuite() {
    sessions_.clear();
    drive_.reset();
  }

  static Pose Truth(std::size_t a, std::size_t b) {
    return drive_->TruthOf(sessions_[0], a).inverse() * drive_->TruthOf(sessions_[0], b);
  }

  MapProfile profile_;
  MergeOptions merge_;
  MatchOptions& options_ = merge_.match;
  MatchWorker worker_{sessions_, {profile_, merge_, testing::SharedWork()}};

  inline static std::unique_ptr<SimulatedSession> drive_;
  inline static std::vector<MergeSession> sessions_;
};

TEST_F(MatchWorkerTest, WhatIsPreparedAnewMatchesAlike) {
  const Pose start = At(0.1, -0.1) * Truth(0, 1);
  const auto first = worker_.Match({0, 0}, {0, 1}, start);
  ASSERT_TRUE(first.has_value()) << first.error().message();
  EXPECT_LT(DistanceBetween(first->T_a_b, Truth(0, 1)), 0.1);
  const auto kept = worker_.Match({0, 0}, {0, 1}, start);
  for (std::size_t round = 0; round < 2; ++round) {
    for (std::size_t i = 0; i + 1 < sessions_[1].submaps.size(); ++i) {
      ASSERT_TRUE(worker_.Match({1, i}, {1, i + 1}, Pose::Identity()).has_value());
    }
  }
  const auto again = worker_.Match({0, 0}, {0, 1}, start);
  for (const auto& other : {kept, again}) {
    ASSERT_TRUE(other.has_value());
    EXPECT_TRUE(other->T_a_b.isApprox(first->T_a_b, 0.0));
    EXPECT_EQ(other->fit, first->fit);
  }
}

TEST_F(MatchWorkerTest, ASearchReachesFartherThanAMatch) {
  const Pose start = At(1.6, -1.2, 0.0, 4.0 * kDegree) * Truth(0, 1);
  const SearchReach reach{2.0, 2.0, 6.0 * kDegree};
  const auto found = worker_.Search({0, 0}, {0, 1}, start, reach);
  ASSERT_TRUE(found.has_value()) << found.error().message();
  EXPECT_TRUE(IsBelieved(*found, options_));
  EXPECT_LT(DistanceBetween(found->T_a_b, Truth(0, 1)), 0.1);
  EXPECT_LT(AngleBetween(found->T_a_b, Truth(0, 1)), 0.5 * kDegree);
}

TEST_F(MatchWorkerTest, WhereNothingStandsNothingIsFound) {
  std::vector<MergeSession> blind{testing::BlindSession("car", testing::Straight(At(0.0), 25))};
  MatchWorker worker(blind, {profile_, merge_, testing::SharedWork()});
  const auto found = worker.Search({0, 0}, {0, 1}, At(10.0), {2.0, 2.0, 6.0 * kDegree});
  ASSERT_TRUE(found.has_value());
  EXPECT_FALSE(IsBelieved(*found, options_));
  const auto match = worker.Match({0, 0}, {0, 1}, At(10.0));
  ASSERT_TRUE(match.has_value());
  EXPECT_FALSE(IsBelieved(*match, options_));
}

}  // namespace
}  // namespace atlas
