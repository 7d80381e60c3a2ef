// How a session's submaps follow each other: by its poses, and better by what they show.
#include "client/merge/plan/session_links.h"

#include <array>
#include <cmath>
#include <numbers>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "tests/client/merge/plan/blind_session.h"
#include "tests/client/merge/plan/simulated_session.h"

namespace atlas {
namespace {

using testing::AngleBetween;
using testing::At;
using testing::BlindSession;
using testing::DistanceBetween;
using testing::Straight;

constexpr double kDegree = std::numbers::pi / 180.0;

std::vector<SessionLink> Links(const std::vector<MergeSession>& sessions,
                               const MergeOptions& options = {}) {
  const MapProfile profile;
  return LinkSessions(sessions, StoredPoses(sessions), {profile, options, testing::SharedWork()})
      .value()[0];
}

TEST(SessionLinksTest, WhatSawNothingIsLinkedByItsPoses) {
  const std::vector<MergeSession> sessions{
      BlindSession("car", Straight(At(3.0, 1.0, 0.0, 0.5), 41))};
  const std::vector<SessionLink> links = Links(sessions);
  ASSERT_EQ(links.size(), 3U);
  const SubmapPoses stored = StoredPoses(sessions);
  for (std::size_t i = 0; i < links.size(); ++i) {
    EXPECT_EQ(links[i].from, i);
    EXPECT_EQ(links[i].to, i + 1);
    EXPECT_FALSE(links[i].is_matched);
    const Pose should = stored[0][i].inverse() * stored[0][i + 1];
    EXPECT_LT(DistanceBetween(links[i].T_from_to, should), 1e-9);
    EXPECT_LT(AngleBetween(links[i].T_from_to, should), 1e-7);
    const double way_m = should.translation().norm();
    EXPECT_NEAR(links[i].information(1, 1), std::pow(0.01 + 0.01 * way_m, -2), 1e-3);
    EXPECT_NEAR(links[i].information(4, 4), std::pow(0.006, -2), 1.0);
    EXPECT_NEAR(links[i].information(5, 5), std::pow((0.05 + 0.005 * way_m) * kDegree, -2), 1.0);
  }
}

// Stretches of it are linked by several threads.
TEST(SessionLinksTest, ALongSessionIsLinkedFromEndToEnd) {
  const std::vector<MergeSession> sessions{BlindSession("one", Straight(At(0.0), 10)),
                                           BlindSession("long", Straight(At(0.0), 500))};
  const MapProfile profile;
  MergeOptions options;
  for (const std::size_t workers : {1U, 3U}) {
    options.workers = workers;
    std::size_t told = 0;
    const auto links =
        LinkSessions(sessions, StoredPoses(sessions), {profile, options, testing::SharedWork()},
                     [&](std::size_t done, std::size_t all) -> Status {
                       EXPECT_GT(done, told);
                       EXPECT_LE(done, all);
                       told = done;
                       return {};
                     })
            .value();
    const std::size_t submaps = sessions[1].submaps.size();
    EXPECT_GT(submaps, 40U);
    EXPECT_EQ(told, sessions[0].submaps.size() + submaps);
    ASSERT_EQ(links.size(), 2U);
    ASSERT_EQ(links[1].size(), submaps - 1);
    for (std::size_t i = 0; i < links[1].size(); ++i) {
      EXPECT_EQ(links[1][i].from, i);
      EXPECT_EQ(links[1][i].to, i + 1);
    }
  }
}

TEST(SessionLinksTest, WhoIsToldOfSubmapsMayEndIt) {
  const std::vector<MergeSession> sessions{BlindSession("car", Straight(At(0.0), 500))};
  const MapProfile profile;
  const MergeOptions options;
  const auto links = LinkSessions(
      sessions, StoredPoses(sessions), {profile, options, testing::SharedWork()},
      [](std::size_t, std::size_t) { return Status(StatusCode::kUnavailable, "enough"); });
  ASSERT_FALSE(links.has_value());
  EXPECT_EQ(links.error().message(), "enough");
}

TEST(SessionLinksTest, NothingLinksOverAJump) {
  std::vector<Pose> poses = Straight(At(0.0), 20);
  const std::vector<Pose> behind = Straight(At(200.0), 20);
  poses.insert(poses.end(), behind.begin(), behind.end());
  const std::vector<SessionLink> links = Links({BlindSession("car", poses)});
  ASSERT_EQ(links.size(), 2U);
  EXPECT_EQ(links[0].from, 0U);
  EXPECT_EQ(links[1].from, 2U);
}

// Though the submaps on both sides fit.
TEST(SessionLinksTest, NothingIsMatchedOverAJump) {
  const testing::SimulatedSession street("car", {.first = 40, .count = 4});
  for (const double jump_m : {10.0, 1.0}) {
    MergeOptions options;
    options.cut.jump_m = jump_m;
    options.cut.length_m = 1.5;
    std::vector<MergeSession> sessions{street.session()};
    ASSERT_TRUE(BuildSubmaps(sessions[0], StoredPoses(sessions[0]), street.reader(),
                             {MapProfile(), options, testing::SharedWork()}, {}, nullptr)
                    .ok());
    ASSERT_GT(sessions[0].submaps.size(), 2U);
    EXPECT_EQ(Links(sessions, options).empty(), jump_m < 1.25);
  }
}

TEST(SessionLinksTest, OneSubmapHasNone) {
  EXPECT_TRUE(Links({BlindSession("car", Straight(At(0.0), 5))}).empty());
}

// A share of what independent features would say, and never better than a match is.
TEST(SessionLinksTest, AMatchInformsNoBetterThanItMay) {
  MergeOptions options;
  SubmapMatch match;
  match.information.diagonal() << 1e3, 1e12, 0.0, 1e12, 1e12, 1e12;
  const PoseInformation6 information = InformationOf(match, options);
  const Eigen::Matrix<double, 6, 6> covariance = information.inverse();
  EXPECT_NEAR(std::sqrt(covariance(0, 0)), std::sqrt(1.0 / 50.0 + 1e-4), 1e-4);
  EXPECT_NEAR(std::sqrt(covariance(1, 1)), 0.01, 1e-5);
  EXPECT_GT(std::sqrt(covariance(2, 2)), 10.0);  // nothing is known of it
  EXPECT_NEAR(std::sqrt(covariance(5, 5)), 0.03 * kDegree, 1e-6);
}

TEST(SessionLinksTest, TheWayGoesAlongMatchesWhereThereAreSome) {
  const MergeSession session = BlindSession("car", Straight(At(7.0, -2.0), 40));
  ASSERT_EQ(session.submaps.size(), 4U);
  const Pose first = StoredPose(session, session.submaps[0]);
  const Pose matched =
      first.inverse() * StoredPose(session, session.submaps[1]) * At(0.0, 0.0, 1.0);
  const std::vector<SessionLink> links{
      {0, 1, At(99.0), PoseInformation6::Identity(), false},
      {0, 1, matched, PoseInformation6::Identity(), true},
      {0, 2, At(99.0), PoseInformation6::Identity(), true}};  // not to the next
  const SessionWay way = WayOf(session, links);
  ASSERT_EQ(way.T_session_submap.size(), 4U);
  EXPECT_LT(DistanceBetween(way.T_session_submap[0], first), 1e-9);
  EXPECT_EQ(way.way_m[0], 0.0);
  for (std::size_t i = 1; i < 4; ++i) {
    const Pose should = At(0.0, 0.0, 1.0) * StoredPose(session, session.submaps[i]);
    EXPECT_LT(DistanceBetween(way.T_session_submap[i], should), 1e-6) << i;
    EXPECT_GT(way.way_m[i], way.way_m[i - 1] + 5.0);
  }
}

// Of what drifts within submaps, too.
TEST(SessionLinksTest, OnAStreetMatchesAreBetterThanOdometry) {
  const testing::SimulatedSession street(
      "car", {.first = 40, .count = 48, .drift = DriftOptions{.seed = 3}});
  std::vector<MergeSession> sessions{street.session()};
  ASSERT_TRUE(BuildSubmaps(sessions[0], StoredPoses(sessions[0]), street.reader(),
                           {MapProfile(), MergeOptions(), testing::SharedWork()}, {}, nullptr)
                  .ok());
  std::array<double, 2> squares_m2{};  // of odometry, of matches
  std::array<std::size_t, 2> links{};
  const std::vector<SessionLink> found = Links(sessions);
  for (std::size_t i = 1; i < found.size(); ++i) {
    if (!found[i].is_matched) continue;
    ASSERT_FALSE(found[i - 1].is_matched);
    const double way_m = found[i - 1].T_from_to.translation().norm();
    EXPECT_NEAR(found[i - 1].information(1, 1), 0.1 * std::pow(0.01 + 0.01 * way_m, -2), 1e-3)
        << "beside a match that is believed";
  }
  for (const SessionLink& link : found) {
    const Pose should =
        street.TruthOf(sessions[0], link.from).inverse() * street.TruthOf(sessions[0], link.to);
    const double off_m = DistanceBetween(link.T_from_to, should);
    squares_m2[link.is_matched ? 1 : 0] += off_m * off_m;
    ++links[link.is_matched ? 1 : 0];
  }
  const auto of = [&](std::size_t kind) {
    return std::sqrt(squares_m2[kind] / static_cast<double>(links[kind]));
  };
  EXPECT_EQ(links[0], sessions[0].submaps.size() - 1);
  EXPECT_GE(links[1], sessions[0].submaps.size() - 2);
  EXPECT_LT(of(1), 0.05);
  EXPECT_LT(of(1), 0.6 * of(0));
}

}  // namespace
}  // namespace atlas
