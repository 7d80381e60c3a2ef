#include "client/merge/change_report.h"

#include <cstddef>
#include <iterator>
#include <utility>

#include "client/merge/changes/merge_changes.h"
#include "client/merge/report/change_picture.h"

namespace atlas {
namespace {

constexpr double kSight_m = 50.0;  // and more of a keyframe is not in the map

bool IsPublished(const MergeRun& run, std::size_t i) {
  return run.sessions[i].is_staged && run.plan.sessions[i].is_joined;
}

// Of all sessions that are published; empty: of none.
Eigen::AlignedBox2d PartOf(const MergeRun& run, const std::vector<PlacedSession>& placed) {
  Eigen::AlignedBox2d part;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    if (!IsPublished(run, i)) continue;
    for (const Pose& pose : placed[i].T_world_sensor) {
      const Eigen::Vector2d p = pose.translation().head<2>();
      part.extend(Eigen::Vector2d(p.array() - kSight_m));
      part.extend(Eigen::Vector2d(p.array() + kSight_m));
    }
  }
  return part;
}

}  // namespace

Result<ChangeReport> ReportChanges(const MergeRun& run, const MergeProgress& progress) {
  std::vector<PlacedSession> placed;
  for (std::size_t i = 0; i < run.sessions.size(); ++i) {
    placed.push_back({&run.sessions[i], run.PosesAfter(i), &run.readers[i]});
  }
  ChangeReport report;
  const Eigen::AlignedBox2d part = PartOf(run, placed);
  if (part.isEmpty()) return report;
  ChangePicture picture(part, run.profile);
  for (std::size_t i = 0; i < placed.size(); ++i) {
    if (!IsPublished(run, i)) continue;
    std::vector<PlacedSession> earlier;
    for (std::size_t k = 0; k < placed.size(); ++k) {
      const bool is_before = IsEarlier(run.sessions[k], run.sessions[i]);
      if (is_before && run.plan.sessions[k].is_joined) earlier.push_back(placed[k]);
    }
    if (earlier.empty()) continue;
    auto changes = ChangesSeenBy(
        placed[i], earlier, run.profile, {}, [&](const Tile& tile) { picture.Draw(tile); },
        [&](std::size_t done, std::size_t all) {
          return progress ? progress("changes", done, all) : Status();
        });
    if (!changes) return Error(changes.error());
    report.changes.insert(report.changes.end(), std::make_move_iterator(changes->begin()),
                          std::make_move_iterator(changes->end()));
  }
  report.picture = picture.Finish(report.changes);
  return report;
}

}  // namespace atlas
