// A merge of simulated drives as a test plans it, beside where they truly were.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "client/merge/plan/merge_planner.h"
#include "tests/client/merge/plan/blind_session.h"
#include "tests/client/merge/plan/simulated_session.h"

namespace atlas::testing {

// A merge of some of the drives, in some order; its results by the drive.
class Merge {
 public:
  explicit Merge(std::shared_ptr<MergeWork> work = NewWork()) : work_(std::move(work)) {}

  static std::shared_ptr<MergeWork> NewWork() {
    return std::make_shared<MergeWork>(MergeWork::Temporary().value());
  }
  const std::shared_ptr<MergeWork>& work() const { return work_; }

  void Add(const SimulatedSession& drive, bool is_staged) {
    drives_.push_back(&drive);
    sessions_.push_back(drive.session());
    sessions_.back().is_staged = is_staged;
    readers_.push_back([this, reader = drive.reader()](std::size_t i) {
      ++reads_;
      return reader(i);
    });
  }
  // As they are after `other`.
  void AddMerged(const Merge& other, std::initializer_list<std::size_t> sessions) {
    for (const std::size_t i : sessions) {
      Add(*other.drives_[i], false);
      const std::vector<Pose> after = other.After(i);
      for (std::size_t k = 0; k < after.size(); ++k) {
        sessions_.back().keyframes[k].T_world_sensor = QuantizedPose::FromPose(after[k]);
      }
    }
  }
  std::size_t reads() const { return reads_; }
  std::size_t keyframes() const {
    std::size_t all = 0;
    for (const MergeSession& session : sessions_) all += session.keyframes.size();
    return all;
  }

  Result<MergePlan> Plan(const MergeProgress& progress = nullptr,
                         const MoreClosures& more = nullptr) {
    return PlanMerge(sessions_, readers_, {MapProfile(), options_, *work_}, progress, more);
  }
  void MustPlan(const MergeProgress& progress = nullptr, const MoreClosures& more = nullptr) {
    auto plan = Plan(progress, more);
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
    EXPECT_LT(error.turn_rad, kTenth_rad);
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
      EXPECT_LT(AngleBetween(closure.match.T_a_b, should), 6.0 * kTenth_rad);
      EXPECT_LT(plan_.closure_off_m[i], 0.1);
      EXPECT_LT(plan_.closure_off_rad[i], 3.0 * kTenth_rad);
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
  static constexpr double kTenth_rad = 0.1 * std::numbers::pi / 180.0;

  std::vector<const SimulatedSession*> drives_;
  std::vector<MergeSession> sessions_;
  std::vector<BlobReader> readers_;
  MergeOptions options_;
  std::shared_ptr<MergeWork> work_;
  std::size_t reads_ = 0;
  MergePlan plan_;
};

}  // namespace atlas::testing
