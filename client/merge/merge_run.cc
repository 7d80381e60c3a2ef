#include "client/merge/merge_run.h"

#include <algorithm>
#include <utility>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

std::vector<Eigen::Vector2d> PlacesOf(const std::vector<Pose>& poses) {
  std::vector<Eigen::Vector2d> places;
  places.reserve(poses.size());
  for (const Pose& pose : poses) {
    places.emplace_back(pose.translation().head<2>());
  }
  return places;
}

}  // namespace

std::vector<PoseCorrection> MergeRun::Corrections() const {
  std::vector<PoseCorrection> corrections;
  for (std::size_t i = 0; i < sessions.size(); ++i) {
    for (const MovedKeyframe& moved : plan.sessions[i].moved) {
      corrections.push_back({{sessions[i].key, sessions[i].keyframes[moved.keyframe].sequence},
                             moved.T_world_sensor});
    }
  }
  return corrections;
}

std::vector<SessionKey> MergeRun::Published() const {
  std::vector<SessionKey> published;
  for (std::size_t i = 0; i < sessions.size(); ++i) {
    if (sessions[i].is_staged && plan.sessions[i].is_joined) published.push_back(sessions[i].key);
  }
  return published;
}

std::vector<Pose> MergeRun::PosesAfter(std::size_t session) const {
  std::vector<Pose> poses = StoredPoses(sessions[session]);
  for (const MovedKeyframe& moved : plan.sessions[session].moved) {
    poses[moved.keyframe] = moved.T_world_sensor.ToPose();
  }
  return poses;
}

std::vector<UnmergedSession> UnmergedOf(const MergeRun& run,
                                        const std::vector<SessionKey>& wanted) {
  std::vector<UnmergedSession> unmerged;
  for (const SessionKey& key : wanted) {
    const auto session = std::find_if(run.sessions.begin(), run.sessions.end(),
                                      [&](const MergeSession& one) { return one.key == key; });
    if (session != run.sessions.end()) {
      const auto i = static_cast<std::size_t>(session - run.sessions.begin());
      const SessionOutcome& outcome = run.plan.sessions[i];
      if (!outcome.is_joined) unmerged.push_back({key, outcome.why_not, !outcome.is_refused});
      continue;
    }
    const auto left_out = std::find_if(run.left_out.begin(), run.left_out.end(),
                                       [&](const LeftOut& one) { return one.key == key; });
    if (left_out != run.left_out.end()) unmerged.push_back({key, left_out->why});
  }
  return unmerged;
}

MergePicture MergeRun::Picture() const {
  MergePicture picture;
  for (std::size_t i = 0; i < sessions.size(); ++i) {
    const char* const fate = plan.sessions[i].is_joined ? "" : ", stays as it is";
    picture.sessions.push_back({StrCat(sessions[i].key, fate), PlacesOf(StoredPoses(sessions[i])),
                                PlacesOf(PosesAfter(i))});
  }
  for (const FoundClosure& closure : plan.closures) {
    const std::size_t a = At(sessions, closure.a).middle();
    const std::size_t b = At(sessions, closure.b).middle();
    const std::vector<Eigen::Vector2d>& a_before = picture.sessions[closure.a.session].before;
    const std::vector<Eigen::Vector2d>& b_before = picture.sessions[closure.b.session].before;
    picture.closures_before.emplace_back(a_before[a], b_before[b]);
    const std::vector<Eigen::Vector2d>& a_after = picture.sessions[closure.a.session].after;
    const std::vector<Eigen::Vector2d>& b_after = picture.sessions[closure.b.session].after;
    picture.closures_after.emplace_back(a_after[a], b_after[b]);
  }
  const double side_m = profile.tile_size_m();
  for (const TileId& id : plan.tiles) {
    const Eigen::Vector2d corner = side_m * Eigen::Vector2d(id.x, id.y);
    picture.tiles.emplace_back(corner, corner + Eigen::Vector2d::Constant(side_m));
  }
  return picture;
}

Result<MergeRun> RunMerge(SessionSource& source,
                          const std::vector<SessionKey>& wanted,
                          const MergeOptions& options,
                          MergeWork& work,
                          const MergeProgress& progress,
                          const MoreClosures& more_closures) {
  // Before much is read.
  if (Status status = options.Validate(); !status.ok()) return Error(std::move(status));
  Result<KeyframeSpool> created = KeyframeSpool::Create();
  if (!created) return Error(created.error());
  auto spool = std::make_shared<KeyframeSpool>(*std::move(created));
  auto read = ReadForMerge(source, wanted, *spool, [&](std::size_t done, std::size_t all) {
    return progress ? progress("keyframes", done, all) : Status();
  });
  if (!read) return Error(read.error());
  auto plan = PlanMerge(read->sessions, read->readers, {source.profile(), options, work}, progress,
                        more_closures);
  if (!plan) return Error(plan.error());
  return MergeRun{std::move(read->sessions), *std::move(plan),
                  std::move(read->left_out), read->revision,
                  source.profile(),          std::move(read->readers),
                  std::move(spool)};
}

Result<PoseBatchSummary> ApplyMerge(const MergeRun& run,
                                    AtlasClient& client,
                                    const std::string& author) {
  return client.UpdatePoses(run.Corrections(), author, {run.revision, run.Published()});
}

}  // namespace atlas
