#include "client/drive/anchor/session_anchor.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <utility>

#include "client/drive/impossible_steps.h"
#include "client/map/daemon_source.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr std::chrono::milliseconds kPatience{60'000};  // until what is there is fused
// Stored poses are whole micrometres.
constexpr double kSameShift_m = 1e-4;
constexpr double kSameYaw_rad = 1e-6;

bool IsOwnFrame(const LevelTransform& transform) {
  return transform.shift_m.norm() < kSameShift_m && std::abs(transform.yaw_rad) < kSameYaw_rad;
}

// Whether it is selected or not; null: there is none of that number.
const DriveScan* FindScan(const DriveFolder& drive, std::uint32_t number) {
  const auto found =
      std::lower_bound(drive.scans.begin(), drive.scans.end(), number,
                       [](const DriveScan& scan, std::uint32_t n) { return scan.number < n; });
  return found != drive.scans.end() && found->number == number ? &*found : nullptr;
}

// What the last keyframe that is there says. nullopt: none is.
Result<std::optional<SessionAnchor>> Resumed(const AnchoredDrive& drive,
                                             const SessionKey& session,
                                             const SessionSummary& stored,
                                             AtlasClient& client) {
  const auto keyframes = client.ListKeyframes(session);
  if (!keyframes) return Error(keyframes.error());
  if (keyframes->empty()) return std::nullopt;
  const auto is_ours = [&drive](const KeyframeSummary& keyframe) {
    const DriveScan* scan = FindScan(drive.drive, keyframe.sequence);
    return scan != nullptr &&
           std::llround(1e3 * (drive.start_s + ScanTime_s(*scan))) == keyframe.time_ms;
  };
  const auto last = std::find_if(keyframes->rbegin(), keyframes->rend(), is_ours);
  if (last == keyframes->rend()) {
    return Error(
        StatusCode::kConflict,
        StrCat("session ", session, " is there already, and none of its ", keyframes->size(),
               " keyframes has number and time of a scan of this drive: another drive's, or at "
               "other times (--start); --session gives this one another name"));
  }
  SessionAnchor anchor;
  anchor.key = session;
  anchor.is_resumed = true;
  const LevelTransform transform = LevelTransformBetween(
      last->T_world_sensor.ToPose(), FindScan(drive.drive, last->sequence)->T_world_sensor);
  if (stored.state == "staged" && IsOwnFrame(transform)) {
    anchor.part.why_not = "it was begun in the drive's own frame";
  } else {
    anchor.part.T_map_drive = transform;
  }
  return anchor;
}

// The whole map, read when it is needed first.
class Map {
 public:
  Map(const DriveSurvey& survey, const AnchorOptions& options, AtlasClient& client)
      : survey_(survey), options_(options), client_(client), source_(client), view_(source_) {}

  Result<SessionAnchor> Anchor(const SessionScans& session) {
    if (!anchoring_) {
      // What is not fused in time, damaged tiles among it, is left out.
      const auto fused = client_.WaitUntilFused(kPatience);
      if (!fused && fused.error().code() != StatusCode::kTimeout) return Error(fused.error());
      auto anchoring = PartAnchoring::Create(survey_, view_, options_);
      if (!anchoring) return Error(anchoring.error());
      anchoring_.emplace(*std::move(anchoring));
    }
    auto part = anchoring_->Find(session.scans, session.is_first);
    if (!part) return Error(part.error());
    return SessionAnchor{session.key, *std::move(part), false};
  }

 private:
  const DriveSurvey& survey_;
  const AnchorOptions& options_;
  AtlasClient& client_;
  DaemonSource source_;
  MapView view_;
  std::optional<PartAnchoring> anchoring_;
};

}  // namespace

Result<std::vector<SessionAnchor>> AnchorSessions(const AnchoredDrive& drive,
                                                  const std::vector<SessionScans>& sessions,
                                                  const AnchorOptions& options,
                                                  AtlasClient& client) {
  if (sessions.empty()) return std::vector<SessionAnchor>();
  const auto stored = client.ListSessions(sessions.front().key.vehicle);
  if (!stored) return Error(stored.error());
  Map map(drive.survey, options, client);
  std::vector<SessionAnchor> anchors;
  for (const SessionScans& session : sessions) {
    const auto known = std::find_if(stored->begin(), stored->end(),
                                    [&](const SessionSummary& s) { return s.key == session.key; });
    if (known != stored->end()) {
      auto resumed = Resumed(drive, session.key, *known, client);
      if (!resumed) return Error(resumed.error());
      if (*resumed) {
        anchors.push_back(**std::move(resumed));
        continue;
      }
    }
    auto anchor = map.Anchor(session);
    if (!anchor) return Error(anchor.error());
    anchors.push_back(*std::move(anchor));
  }
  return anchors;
}

}  // namespace atlas
