#include "client/merge/plan/session_links.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include <Eigen/LU>

#include "client/merge/plan/match_worker.h"
#include "client/merge/plan/parallel.h"

namespace atlas {
namespace {

Pose Between(const MergeSession& session, std::size_t from, std::size_t to) {
  return StoredPose(session, session.submaps[from]).inverse() *
         StoredPose(session, session.submaps[to]);
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

// Some submaps of one session in a row, whose links are one worker's.
struct Stretch {
  std::size_t session = 0;
  std::size_t begin = 0;
  std::size_t end = 0;
};

// What is prepared of a submap serves two links: of one stretch, but for its first.
std::vector<Stretch> StretchesOf(const std::vector<MergeSession>& sessions) {
  constexpr std::size_t kOnEnd = 16;
  std::vector<Stretch> stretches;
  for (std::size_t i = 0; i < sessions.size(); ++i) {
    const std::size_t count = sessions[i].submaps.size();
    for (std::size_t begin = 0; begin < count; begin += kOnEnd) {
      stretches.push_back({i, begin, std::min(begin + kOnEnd, count)});
    }
  }
  return stretches;
}

// Those that begin in the stretch; `T_world_submap` of all submaps of its session.
Result<std::vector<SessionLink>> LinkStretch(const Stretch& stretch,
                                             const std::vector<MergeSession>& sessions,
                                             const std::vector<Pose>& T_world_submap,
                                             const MergeOptions& options,
                                             MatchWorker& worker) {
  const std::size_t session = stretch.session;
  const MergeSession& own = sessions[session];
  std::vector<SessionLink> links;
  for (std::size_t from = stretch.begin; from < stretch.end; ++from) {
    const std::size_t to = from + 1;
    if (to == own.submaps.size() || own.submaps[to].cut.follows_jump) continue;
    links.push_back(OdometryLink(own, from, options));
    const auto match = worker.Match({session, from}, {session, to},
                                    T_world_submap[from].inverse() * T_world_submap[to]);
    if (!match) return Error(match.error());
    if (IsBelieved(*match, options.match) &&
        IsNear(match->T_a_b, Between(own, from, to), options)) {
      links.back().information *= options.odometry_share;
      links.push_back({from, to, match->T_a_b, InformationOf(*match, options), true});
    }
  }
  return links;
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

Result<std::vector<std::vector<SessionLink>>> LinkSessions(
    const std::vector<MergeSession>& sessions,
    const SubmapPoses& T_world_submap,
    const MergeContext& context,
    const std::function<Status(std::size_t done, std::size_t all)>& progress) {
  const std::vector<Stretch> stretches = StretchesOf(sessions);
  std::size_t all = 0;
  for (const MergeSession& session : sessions) all += session.submaps.size();
  std::vector<MatchWorker> workers;
  for (std::size_t i = 0; i < context.options.workers; ++i) workers.emplace_back(sessions, context);
  std::vector<std::vector<SessionLink>> of_stretch(stretches.size());
  std::mutex mutex;
  std::size_t done = 0;
  Status status = RunParallel(
      stretches.size(), workers.size(), [&](std::size_t worker, std::size_t i) -> Status {
        const Stretch& stretch = stretches[i];
        auto links = LinkStretch(stretch, sessions, T_world_submap[stretch.session],
                                 context.options, workers[worker]);
        if (!links) return links.error();
        of_stretch[i] = *std::move(links);
        const std::lock_guard lock(mutex);
        done += stretch.end - stretch.begin;
        return progress ? progress(done, all) : Status();
      });
  if (!status.ok()) return Error(std::move(status));
  std::vector<std::vector<SessionLink>> links(sessions.size());
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    std::vector<SessionLink>& of_session = links[stretches[i].session];
    of_session.insert(of_session.end(), of_stretch[i].begin(), of_stretch[i].end());
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
