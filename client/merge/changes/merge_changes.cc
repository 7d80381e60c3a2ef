#include "client/merge/changes/merge_changes.h"

#include <cmath>
#include <cstdint>
#include <set>
#include <utility>

#include "client/merge/changes/find_changes.h"
#include "client/merge/changes/fused_side.h"

namespace atlas {
namespace {

// Keyframes further from all of a session's see nothing of what that saw: their reaches are less
// than 100 m together.
class Nearby {
 public:
  explicit Nearby(const std::vector<Pose>& poses) {
    for (const Pose& pose : poses) {
      const Square at = Of(pose.translation());
      for (std::int64_t x = -1; x <= 1; ++x) {
        for (std::int64_t y = -1; y <= 1; ++y) squares_.emplace(at.first + x, at.second + y);
      }
    }
  }
  bool operator()(const Eigen::Vector3d& p) const { return squares_.contains(Of(p)); }

 private:
  using Square = std::pair<std::int64_t, std::int64_t>;
  static constexpr double kSide_m = 100.0;

  static Square Of(const Eigen::Vector3d& p) {
    return {static_cast<std::int64_t>(std::floor(p.x() / kSide_m)),
            static_cast<std::int64_t>(std::floor(p.y() / kSide_m))};
  }

  std::set<Square> squares_;
};

std::int64_t MiddleTime(const MergeSession& session) {
  return session.keyframes[session.keyframes.size() / 2].time_ms;
}

}  // namespace

bool IsEarlier(const MergeSession& one, const MergeSession& other) {
  return MiddleTime(one) < MiddleTime(other);
}

Result<std::vector<MapChange>> ChangesSeenBy(
    const PlacedSession& later,
    const std::vector<PlacedSession>& earlier,
    const MapProfile& profile,
    const ChangeOptions& options,
    const std::function<void(const Tile&)>& on_tile,
    const std::function<Status(std::size_t done, std::size_t all)>& progress) {
  const Nearby is_near(later.T_world_sensor);
  FusedSide before(profile);
  FusedSide after(profile);
  Status status = after.Add(*later.session, later.T_world_sensor, *later.read, is_near);
  for (auto other = earlier.begin(); other != earlier.end() && status.ok(); ++other) {
    status = before.Add(*other->session, other->T_world_sensor, *other->read, is_near);
  }
  if (!status.ok()) return Error(std::move(status));
  auto changes = FindChanges(before, after, profile, options, on_tile, progress);
  if (!changes) return changes;
  for (MapChange& change : *changes) change.seen_by = later.session->key;
  return changes;
}

}  // namespace atlas
