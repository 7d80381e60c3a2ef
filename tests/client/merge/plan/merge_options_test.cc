#include "client/merge/plan/merge_options.h"

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "client/merge/plan/merge_planner.h"
#include "tests/client/merge/plan/blind_session.h"

namespace atlas {
namespace {

using Change = std::function<void(MergeOptions&, double)>;

void ExpectRefused(const std::string& name, const Change& change, double value) {
  MergeOptions options;
  change(options, value);
  const Status status = options.Validate();
  EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << name << " " << value;
  EXPECT_NE(status.message().find(name), std::string::npos) << status.message();
}

TEST(MergeOptionsTest, DefaultsAreFine) {
  EXPECT_TRUE(MergeOptions().Validate().ok());
  MergeOptions options;
  options.refinements = 0;
  options.guided_rounds = 0;
  options.odometry_drift = 0.0;
  options.min_move_m = 0.0;
  EXPECT_TRUE(options.Validate().ok());
}

TEST(MergeOptionsTest, CountsAreAtLeastOne) {
  ExpectRefused(
      "workers", [](MergeOptions& o, double) { o.workers = 0; }, 0.0);
  ExpectRefused(
      "probe_stride", [](MergeOptions& o, double) { o.probe_stride = 0; }, 0.0);
  ExpectRefused(
      "min_closures", [](MergeOptions& o, double) { o.min_closures = 0; }, 0.0);
  ExpectRefused(
      "cut.max_keyframes", [](MergeOptions& o, double) { o.cut.max_keyframes = 0; }, 0.0);
  ExpectRefused(
      "priors.min_priors", [](MergeOptions& o, double) { o.priors.min_priors = 0; }, 0.0);
  ExpectRefused(
      "graph.threads", [](MergeOptions& o, double) { o.graph.threads = 0; }, 0.0);
  ExpectRefused(
      "refinements", [](MergeOptions& o, double) { o.refinements = -1; }, 0.0);
  ExpectRefused(
      "guided_rounds", [](MergeOptions& o, double) { o.guided_rounds = -1; }, 0.0);
}

TEST(MergeOptionsTest, NumbersAreNumbers) {
  const std::vector<std::pair<std::string, Change>> changes{
      {"odometry_drift",
       [](MergeOptions& o, double v) {
         o.odometry_drift = v;
       }},
      {"odometry_sigma_m",
       [](MergeOptions& o, double v) {
         o.odometry_sigma_m = v;
       }},
      {"information_share",
       [](MergeOptions& o, double v) {
         o.information_share = v;
       }},
      {"match_sigma_rad",
       [](MergeOptions& o, double v) {
         o.match_sigma_rad = v;
       }},
      {"near_m",
       [](MergeOptions& o, double v) {
         o.near_m = v;
       }},
      {"min_margin",
       [](MergeOptions& o, double v) {
         o.min_margin = v;
       }},
      {"guided_m",
       [](MergeOptions& o, double v) {
         o.guided_m = v;
       }},
      {"max_surprise_rad",
       [](MergeOptions& o, double v) {
         o.max_surprise_rad = v;
       }},
      {"held_m",
       [](MergeOptions& o, double v) {
         o.held_m = v;
       }},
      {"min_move_rad",
       [](MergeOptions& o, double v) {
         o.min_move_rad = v;
       }},
      {"cut.length_m",
       [](MergeOptions& o, double v) {
         o.cut.length_m = v;
       }},
      {"graph.tilt_sigma_rad",
       [](MergeOptions& o, double v) {
         o.graph.tilt_sigma_rad = v;
       }},
      {"contradicted_m",
       [](MergeOptions& o, double v) {
         o.contradicted_m = v;
       }},
      {"odometry_share",
       [](MergeOptions& o, double v) {
         o.odometry_share = v;
       }},
      {"priors.together_s",
       [](MergeOptions& o, double v) {
         o.priors.together_s = v;
       }},
      {"priors.max_frame_shift_m",
       [](MergeOptions& o, double v) {
         o.priors.max_frame_shift_m = v;
       }},
      {"known_shape.rad",
       [](MergeOptions& o, double v) {
         o.known_shape.rad = v;
       }},
      {"refined_shape.metres", [](MergeOptions& o, double v) {
         o.refined_shape.metres = v;
       }}};
  for (const auto& [name, change] : changes) {
    ExpectRefused(name, change, -0.01);
    ExpectRefused(name, change, std::numeric_limits<double>::quiet_NaN());
    ExpectRefused(name, change, std::numeric_limits<double>::infinity());
  }
  for (const std::size_t i : {1U, 2U, 3U, 8U, 10U, 11U}) {  // divided by, or nothing would go on
    ExpectRefused(changes[i].first, changes[i].second, 0.0);
  }
}

TEST(MergeOptionsTest, AMergeLooksAtThem) {
  MergeOptions options;
  options.workers = 0;  // it would wait for nobody for ever
  std::vector<MergeSession> sessions;
  const auto plan =
      PlanMerge(sessions, {}, {MapProfile(), options, testing::SharedWork()}, nullptr);
  ASSERT_FALSE(plan.has_value());
  EXPECT_EQ(plan.error().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace atlas
