#include "client/drive/anchor/session_anchor.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <set>
#include <string>
#include <string_view>
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
// What was anchored lies in one frame to a micrometre, what a merge corrected is bent by more.
constexpr double kOneFrame_m = 2e-3;

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

// A session that is there.
struct Begun {
  SessionAnchor anchor;
  std::set<std::uint32_t> scans;  // of this drive, by number, of which it has keyframes
  double bent_m = 0.0;  // how far one of these is from where the frame of the last puts it, at most
};

// What the last keyframe that is there says. nullopt: none is.
Result<std::optional<Begun>> Resumed(const AnchoredDrive& drive,
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
  Begun begun;
  SessionAnchor& anchor = begun.anchor;
  anchor.key = session;
  anchor.is_resumed = true;
  const LevelTransform transform = LevelTransformBetween(
      last->T_world_sensor.ToPose(), FindScan(drive.drive, last->sequence)->T_world_sensor);
  if (stored.state == "staged" && IsOwnFrame(transform)) {
    anchor.part.why_not =
        "it was begun in the drive's own frame; --session gives another try another name, and "
        "atlas-merge run aligns what is staged";
  } else {
    anchor.part.T_map_drive = transform;
  }
  const Pose T_map_drive = transform.ToPose();
  for (const KeyframeSummary& keyframe : *keyframes) {
    if (!is_ours(keyframe)) continue;
    begun.scans.insert(keyframe.sequence);
    const Pose& T_drive_sensor = FindScan(drive.drive, keyframe.sequence)->T_world_sensor;
    const Eigen::Vector3d off_m =
        keyframe.T_world_sensor.ToPose().translation() - T_map_drive * T_drive_sensor.translation();
    begun.bent_m = std::max(begun.bent_m, off_m.norm());
  }
  return begun;
}

constexpr std::string_view kOtherName =
    "; --session gives what is not there yet another name, and atlas-merge run aligns it where it "
    "is staged";
constexpr std::string_view kOrResume =
    "; --resume ends what an earlier run accepted and did not end";

// Of one that is there already.
Status CheckPrior(const SessionScans& session,
                  const SessionAnchor& anchor,
                  const AnchorOptions& options) {
  if (!session.is_first || !anchor.is_anchored()) return {};
  const Eigen::Vector3d begin_m =
      anchor.part.T_map_drive->ToPose() * session.scans.front()->T_world_sensor.translation();
  if (BeginsWithin(begin_m, options.prior, options)) return {};
  return {StatusCode::kConflict,
          StrCat("session ", session.key, " is there already, and begins at (", begin_m.x(), ", ",
                 begin_m.y(), ", ", begin_m.z(),
                 ") m, further from the prior than that is said to be off; --session gives this "
                 "drive another name")};
}

// The whole map, read when it is needed first.
class Map {
 public:
  Map(const AnchoredDrive& drive, const AnchorOptions& options, AtlasClient& client)
      : drive_(drive), options_(options), client_(client), source_(client), view_(source_) {}

  Result<SessionAnchor> Anchor(const SessionScans& session) {
    if (Status status = Read(); !status.ok()) return Error(std::move(status));
    auto part = anchoring_->Find(session.scans, session.is_first);
    if (!part) return Error(part.error());
    return SessionAnchor{session.key, *std::move(part), false};
  }

  // Whether what comes to a session lies where its frame puts it, as far as that is mapped;
  // kConflict.
  Status CheckGoesOn(const SessionScans& session, const Begun& begun) {
    std::vector<const DriveScan*> scans;
    for (const DriveScan* scan : session.scans) {
      if (!begun.scans.contains(scan->number)) scans.push_back(scan);
    }
    if (scans.empty()) return {};
    const auto refused = [&](const std::string& why, std::string_view or_else = "") -> Status {
      return {StatusCode::kConflict, StrCat("session ", session.key, why, kOtherName, or_else)};
    };
    if (begun.bent_m > kOneFrame_m) {
      return refused(StrCat(" was corrected since it was begun: its keyframes lie up to ",
                            InThousandths(begun.bent_m), " m from where one frame puts them"));
    }
    if (options_.is_rest_accepted) return {};
    ATLAS_RETURN_IF_ERROR(Read());
    const auto misfit = anchoring_->Measure(scans, *begun.anchor.part.T_map_drive);
    if (!misfit) return misfit.error();
    if (misfit->astray > misfit->tracked) {
      return refused(StrCat(": of what is new of the drive ", misfit->astray,
                            " scans do not fit the map where the session's frame puts them, and ",
                            misfit->tracked, " do"),
                     kOrResume);
    }
    const std::string bent = WhyBeyond(*misfit, options_.limits_of_rest);
    if (!bent.empty()) return refused(StrCat(": what is new of the drive is ", bent), kOrResume);
    return {};
  }

 private:
  Status Read() {
    if (anchoring_) return {};
    // What is not fused in time, damaged tiles among it, is left out.
    const auto fused = client_.WaitUntilFused(kPatience);
    if (!fused && fused.error().code() != StatusCode::kTimeout) return fused.error();
    auto anchoring =
        PartAnchoring::Create(drive_.survey, drive_.motion, drive_.positions, view_, options_);
    if (!anchoring) return anchoring.error();
    anchoring_.emplace(*std::move(anchoring));
    return {};
  }

  const AnchoredDrive& drive_;
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
  Map map(drive, options, client);
  std::vector<SessionAnchor> anchors;
  for (const SessionScans& session : sessions) {
    const auto known = std::find_if(stored->begin(), stored->end(),
                                    [&](const SessionSummary& s) { return s.key == session.key; });
    if (known != stored->end()) {
      auto resumed = Resumed(drive, session.key, *known, client);
      if (!resumed) return Error(resumed.error());
      if (*resumed) {
        if ((*resumed)->anchor.is_anchored()) {
          Status status = map.CheckGoesOn(session, **resumed);
          if (!status.ok()) return Error(std::move(status));
        }
        if (Status status = CheckPrior(session, (*resumed)->anchor, options); !status.ok()) {
          return Error(std::move(status));
        }
        anchors.push_back(std::move((*resumed)->anchor));
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
