#include "client/merge/plan/session_links.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

namespace atlas {
namespace {

Pose Between(const MergeSession& session, std::size_t from, std::size_t to) {
  return StoredPose(session, session.submaps[from]).inverse() *
         StoredPose(session, session.submaps[to]);
}

bool HasJump(const MergeSession& session, std::size_t from, std::size_t to) {
  for (std::size_t i = from + 1; i <= to; ++i) {
    if (session.submaps[i].cut.follows_jump) return true;
  }
  return false;
}

SessionLink OdometryLink(const MergeSession& session,
                         std::size_t from,
                         const MergeOptions& options) {
  SessionLink link{from, from + 1, Between(session, from, from + 1)};
  const double way_m = link.T_from_to.translation().norm();
  const double place_m = options.odometry_sigma_m + options.odometry_drift * way_m;
  const double turn_rad = options.odometry_sigma_rad + options.odometry_yaw_rad_a_m * way_m;
  Eigen::Matrix<double, 6, 1> sigmas;
  sigmas << place_m, place_m, place_m, options.graph.tilt_sigma_rad, options.graph.tilt_sigma_rad,
      turn_rad;
  link.information = sigmas.cwiseAbs2().cwiseInverse().asDiagonal();
  return link;
}

// A match that says otherwise than odometry might is of something else.
bool IsNear(const Pose& matched, const Pose& expected, const MergeOptions& options) {
  constexpr double kSigmas = 4.0;
  const double way_m = expected.translation().norm();
  const double turned =
      Eigen::Quaterniond(matched.linear()).angularDistance(Eigen::Quaterniond(expected.linear()));
  return (matched.translation() - expected.translation()).norm() <=
             kSigmas * (options.odometry_sigma_m + options.odometry_drift * way_m) &&
         turned <= kSigmas * (options.odometry_sigma_rad + options.odometry_yaw_rad_a_m * way_m +
                              options.graph.tilt_sigma_rad);
}

}  // namespace

PoseInformation6 InformationOf(const SubmapMatch& match, const MergeOptions& options) {
  constexpr double kLittle = 1e-3;
  Eigen::Matrix<double, 6, 1> floor;
  floor.head<3>().setConstant(options.match_sigma_m * options.match_sigma_m);
  floor.tail<3>().setConstant(options.match_sigma_rad * options.match_sigma_rad);
  const PoseInformation6 seen =
      options.information_share * match.information + kLittle * PoseInformation6::Identity();
  PoseInformation6 covariance = seen.inverse();
  covariance.diagonal() += floor;
  return covariance.inverse();
}

Result<std::vector<SessionLink>> LinkSession(std::size_t session,
                                             const std::vector<MergeSession>& sessions,
                                             const std::vector<Pose>& T_world_submap,
                                             const MergeOptions& options,
                                             MatchWorker& worker) {
  constexpr std::size_t kAhead = 1;
  const MergeSession& own = sessions[session];
  std::vector<SessionLink> links;
  for (std::size_t from = 0; from + 1 < own.submaps.size(); ++from) {
    if (!HasJump(own, from, from + 1)) links.push_back(OdometryLink(own, from, options));
    for (std::size_t to = from + 1; to <= from + kAhead && to < own.submaps.size(); ++to) {
      if (HasJump(own, from, to)) break;
      const auto match = worker.Match({session, from}, {session, to},
                                      T_world_submap[from].inverse() * T_world_submap[to]);
      if (!match) return Error(match.error());
      if (IsBelieved(*match, options.match) &&
          IsNear(match->T_a_b, Between(own, from, to), options)) {
        if (to == from + 1) links.back().information *= options.odometry_share;
        links.push_back({from, to, match->T_a_b, InformationOf(*match, options), true});
      }
    }
  }
  return links;
}

SessionWay WayOf(const MergeSession& session, const std::vector<SessionLink>& links) {
  SessionWay way;
  std::vector<Pose> steps;  // to each from the one before
  for (std::size_t i = 0; i < session.submaps.size(); ++i) {
    steps.push_back(i == 0 ? StoredPose(session, session.submaps[0]) : Between(session, i - 1, i));
  }
  for (const SessionLink& link : links) {
    if (link.is_matched && link.to == link.from + 1) steps[link.to] = link.T_from_to;
  }
  double way_m = 0.0;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (i > 0) way_m += steps[i].translation().norm();
    way.T_session_submap.push_back(i == 0 ? steps[0] : way.T_session_submap.back() * steps[i]);
    way.way_m.push_back(way_m);
  }
  return way;
}

}  // namespace atlas
