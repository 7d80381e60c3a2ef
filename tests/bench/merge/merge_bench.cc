// A merge of simulated drives with drift (`atlas simulate --drift`), against their true poses.
// Usage: merge_bench FOLDER...   (a session each: poses.txt, truth.txt)
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <map>
#include <set>
#include <string>

#include <Eigen/Geometry>

#include "client/drive/drive_selection.h"
#include "client/drive/drive_survey.h"
#include "client/merge/plan/merge_planner.h"
#include "client/merge/plan/submap_builder.h"
#include "core/keyframe/keyframe_builder.h"
#include "core/keyframe/keyframe_codec.h"
#include "core/keyframe/vehicle_trail.h"
#include "core/scan/scan_reader.h"

namespace atlas {
namespace {

constexpr double kDegree = 57.29577951308232;

struct Drive {
  MergeSession session;
  std::vector<Bytes> blobs;
  std::vector<Pose> truth;
};

Drive ReadDrive(const std::string& folder, std::size_t number, const MapProfile& profile) {
  Drive result;
  DriveFolder drive = OpenDriveFolder(folder).value();
  const std::filesystem::path truth = std::filesystem::path(folder) / "truth.txt";
  const std::vector<Pose> true_poses =
      ReadPoses(std::filesystem::exists(truth) ? truth
                                               : std::filesystem::path(folder) / "poses.txt")
          .value();
  const DriveSurvey survey = SurveyDrive(drive, {}).value();
  KeyframeBuilderOptions options;
  options.mount = survey.mount;
  options.ring_step = survey.ring_step;
  const KeyframeBuilder builder(profile, survey.layout, options);
  result.session.key = {"car" + std::to_string(number), "s"};
  result.session.is_staged = number > 0;
  std::vector<Pose> trail;
  for (const DriveScan& scan : drive.scans) {
    const auto cloud = ReadScan(scan.scan).value();
    trail.push_back(scan.T_world_sensor);
    const YawAndLevel split = SplitYaw(Eigen::Quaterniond(scan.T_world_sensor.linear()));
    result.blobs.push_back(EncodeKeyframe(builder.Build(
        cloud, {split.R_level_sensor, GridYaw(scan.number)}, TrailBefore(trail, builder.mount()))));
    result.session.keyframes.push_back(
        {scan.number, static_cast<std::int64_t>(1000.0 * scan.time_s.value_or(0.1 * scan.number)),
         QuantizedPose::FromPose(scan.T_world_sensor), std::nullopt});
    result.truth.push_back(true_poses[scan.number]);
  }
  return result;
}

struct Rms {
  double sum = 0.0;
  double most = 0.0;
  std::size_t count = 0;
  void Add(double value) {
    sum += value * value;
    most = std::max(most, value);
    ++count;
  }
  double value() const { return count == 0 ? 0.0 : std::sqrt(sum / static_cast<double>(count)); }
};

double AngleOf(const Pose& pose) {
  return Eigen::AngleAxisd(pose.linear()).angle() * kDegree;
}
double YawOf(const Pose& pose) {
  return SplitYaw(Eigen::Quaterniond(pose.linear())).yaw_rad * kDegree;
}

void PrintRelative(const char* name,
                   const std::vector<Drive>& drives,
                   const std::vector<std::vector<Pose>>& poses,
                   const std::vector<bool>& is_joined) {
  constexpr double kNear_m = 5.0;
  Rms place;
  Rms plane;
  Rms turn;
  Rms yaw;
  for (std::size_t s = 0; s < drives.size(); ++s) {
    for (std::size_t t = s + 1; t < drives.size(); ++t) {
      if (!is_joined[s] || !is_joined[t]) continue;
      for (std::size_t i = 0; i < drives[s].truth.size(); ++i) {
        double nearest = kNear_m;
        std::size_t best = drives[t].truth.size();
        for (std::size_t j = 0; j < drives[t].truth.size(); ++j) {
          const double away =
              (drives[s].truth[i].translation() - drives[t].truth[j].translation()).norm();
          if (away < nearest) nearest = away, best = j;
        }
        if (best == drives[t].truth.size()) continue;
        const Pose is = poses[s][i].inverse() * poses[t][best];
        const Pose should = drives[s].truth[i].inverse() * drives[t].truth[best];
        const Pose off = should.inverse() * is;
        place.Add(off.translation().norm());
        plane.Add(off.translation().head<2>().norm());
        turn.Add(AngleOf(off));
        yaw.Add(std::abs(YawOf(off)));
      }
    }
  }
  std::printf(
      "%s relative: %zu pairs, %.3f m (max %.3f, in plane %.3f), %.3f deg (max %.3f, yaw %.3f)\n",
      name, place.count, place.value(), place.most, plane.value(), turn.value(), turn.most,
      yaw.value());
}

void PrintOverall(const char* name,
                  const std::vector<Drive>& drives,
                  const std::vector<std::vector<Pose>>& poses,
                  const std::vector<bool>& is_joined) {
  std::vector<Eigen::Vector3d> is;
  std::vector<Eigen::Vector3d> should;
  for (std::size_t s = 0; s < drives.size(); ++s) {
    if (!is_joined[s]) continue;
    for (std::size_t i = 0; i < poses[s].size(); ++i) {
      is.push_back(poses[s][i].translation());
      should.push_back(drives[s].truth[i].translation());
    }
  }
  Eigen::Matrix3Xd a(3, is.size());
  Eigen::Matrix3Xd b(3, is.size());
  for (std::size_t i = 0; i < is.size(); ++i) {
    a.col(static_cast<Eigen::Index>(i)) = is[i];
    b.col(static_cast<Eigen::Index>(i)) = should[i];
  }
  Pose align;
  align.matrix() = Eigen::umeyama(a, b, false);
  Rms place;
  Rms up;
  Rms turn;
  Rms yaw;
  for (std::size_t s = 0; s < drives.size(); ++s) {
    if (!is_joined[s]) continue;
    for (std::size_t i = 0; i < poses[s].size(); ++i) {
      const Pose off = drives[s].truth[i].inverse() * (align * poses[s][i]);
      place.Add(off.translation().norm());
      turn.Add(AngleOf(off));
      up.Add(std::abs(off.translation().z()));
      yaw.Add(std::abs(YawOf(off)));
    }
  }
  std::printf("%s overall: %.3f m (max %.3f, up %.3f), %.3f deg (max %.3f, yaw %.3f)\n", name,
              place.value(), place.most, up.value(), turn.value(), turn.most, yaw.value());
}

void Main(const std::vector<std::string>& folders) {
  const MapProfile profile;
  const MergeOptions options;
  std::vector<Drive> drives;
  for (const std::string& folder : folders) {
    drives.push_back(ReadDrive(folder, drives.size(), profile));
    std::printf("%s: %zu keyframes\n", folder.c_str(), drives.back().blobs.size());
  }
  const auto began = std::chrono::steady_clock::now();
  const auto seconds = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  };
  std::vector<MergeSession> sessions;
  std::vector<BlobReader> readers;
  for (Drive& drive : drives) {
    sessions.push_back(drive.session);
    readers.push_back([&](std::size_t i) -> Result<Bytes> { return drive.blobs[i]; });
  }
  std::string step;
  const auto plan =
      PlanMerge(sessions, readers, profile, options,
                [&](std::string_view name, std::size_t done, std::size_t all) -> Status {
                  if (done == all) {
                    std::printf("%.*s: %zu, %.1f s\n", static_cast<int>(name.size()), name.data(),
                                all, seconds());
                  }
                  return {};
                });
  if (!plan) {
    std::printf("failed: %s\n", std::string(plan.error().message()).c_str());
    return;
  }
  std::printf("planned: %.1f s, %d rounds, %zu closures, %zu rejected\n", seconds(), plan->rounds,
              plan->closures.size(), plan->rejected);
  for (const SessionMeeting& meeting : plan->meetings) {
    std::printf("  %zu-%zu: %zu found, %zu agree, margin %.2f, %s\n", meeting.a, meeting.b,
                meeting.found, meeting.agreeing, meeting.margin,
                meeting.is_believed ? "believed" : "-");
  }
  std::vector<std::vector<Pose>> before;
  std::vector<std::vector<Pose>> after;
  std::vector<std::vector<Pose>> true_submaps;
  std::vector<bool> is_joined;
  for (std::size_t s = 0; s < drives.size(); ++s) {
    const SessionOutcome& outcome = plan->sessions[s];
    std::printf(
        "  %s: joined %d held %d closures %zu, %zu of %zu submaps met, moved rms %.2f max %.2f\n",
        folders[s].c_str(), outcome.is_joined, outcome.is_held, outcome.closures,
        outcome.submaps_met, outcome.submaps, outcome.rms_move_m, outcome.max_move_m);
    is_joined.push_back(outcome.is_joined);
    before.emplace_back();
    for (const MergeKeyframe& keyframe : sessions[s].keyframes) {
      before.back().push_back(keyframe.T_world_sensor.ToPose());
    }
    after.push_back(before.back());
    for (const MovedKeyframe& moved : outcome.moved) {
      after.back()[moved.keyframe] = moved.T_world_sensor.ToPose();
    }
    true_submaps.emplace_back();
    for (const MergeSubmap& submap : sessions[s].submaps) {
      const std::size_t middle = submap.middle();
      true_submaps.back().push_back(
          drives[s].truth[middle] *
          (sessions[s].T_world_sensor[middle].inverse() * submap.T_world_submap));
    }
  }
  Rms place;
  Rms turn;
  std::size_t wrong = 0;
  std::set<std::pair<SubmapRef, std::size_t>> found;  // a submap, and the session it was found in
  for (const FoundClosure& closure : plan->closures) {
    const Pose should = true_submaps[closure.a.session][closure.a.submap].inverse() *
                        true_submaps[closure.b.session][closure.b.submap];
    const Pose off = should.inverse() * closure.match.T_a_b;
    if (off.translation().norm() > 0.5 || AngleOf(off) > 3.0) {
      ++wrong;
      std::printf("  WRONG %zu/%zu %zu/%zu: %.2f m %.2f deg\n", closure.a.session, closure.a.submap,
                  closure.b.session, closure.b.submap, off.translation().norm(), AngleOf(off));
    }
    place.Add(off.translation().norm());
    turn.Add(AngleOf(off));
    found.emplace(closure.a, closure.b.session);
    found.emplace(closure.b, closure.a.session);
  }
  std::printf("closures: %.3f m (max %.3f), %.3f deg (max %.3f), %zu wrong\n", place.value(),
              place.most, turn.value(), turn.most, wrong);
  for (const bool is_matched : {false, true}) {
    for (const std::size_t ahead : {1U, 2U}) {
      Eigen::Vector3d bias = Eigen::Vector3d::Zero();
      Rms plane;
      Rms up;
      Rms turned;
      Rms yaw;
      double yaw_bias = 0.0;
      for (std::size_t s = 0; s < drives.size(); ++s) {
        for (const SessionLink& link : plan->links[s]) {
          if (link.is_matched != is_matched || link.to != link.from + ahead) continue;
          const Pose& T_world_a = true_submaps[s][link.from];
          const Pose should = T_world_a.inverse() * true_submaps[s][link.to];
          const Eigen::Vector3d off = link.T_from_to.translation() - should.translation();
          // Along the way from one to the other.
          const Eigen::Vector3d along = should.translation().normalized();
          const Eigen::Vector3d left = Eigen::Vector3d::UnitZ().cross(along).normalized();
          bias += Eigen::Vector3d(off.dot(along), off.dot(left), off.z());
          plane.Add(off.head<2>().norm());
          up.Add(std::abs(off.z()));
          const Pose d = link.T_from_to * should.inverse();
          turned.Add(AngleOf(d));
          yaw.Add(std::abs(YawOf(d)));
          yaw_bias += YawOf(d);
        }
      }
      const auto n = static_cast<double>(std::max<std::size_t>(1, plane.count));
      std::printf(
          "links matched %d ahead %zu: %zu, plane %.4f up %.4f turn %.3f yaw %.3f deg, bias along "
          "%.4f left "
          "%.4f up %.4f yaw %.4f\n",
          is_matched, ahead, plane.count, plane.value(), up.value(), turned.value(), yaw.value(),
          bias.x() / n, bias.y() / n, bias.z() / n, yaw_bias / n);
    }
  }
  std::size_t overlaps = 0;
  std::size_t overlaps_found = 0;
  for (std::size_t s = 0; s < drives.size(); ++s) {
    for (std::size_t i = 0; i < true_submaps[s].size(); ++i) {
      for (std::size_t t = 0; t < drives.size(); ++t) {
        if (t == s) continue;
        const bool is_near =
            std::any_of(true_submaps[t].begin(), true_submaps[t].end(), [&](const Pose& other) {
              return (other.translation() - true_submaps[s][i].translation()).norm() < 5.0;
            });
        if (!is_near) continue;
        ++overlaps;
        overlaps_found += found.contains({SubmapRef{s, i}, t}) ? 1 : 0;
      }
    }
  }
  std::printf("overlaps: %zu of %zu found\n", overlaps_found, overlaps);
  PrintRelative("before", drives, before, is_joined);
  PrintRelative("after", drives, after, is_joined);
  PrintOverall("before", drives, before, is_joined);
  PrintOverall("after", drives, after, is_joined);
}

}  // namespace
}  // namespace atlas

int main(int argc, char** argv) {
  atlas::Main({argv + 1, argv + argc});
}
