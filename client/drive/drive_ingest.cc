#include "client/drive/drive_ingest.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <span>

#include "client/drive/drive_motion.h"
#include "client/drive/drive_survey.h"
#include "client/drive/impossible_steps.h"
#include "client/score/cpu_timer.h"
#include "core/base/str_cat.h"
#include "core/keyframe/keyframe_builder.h"
#include "core/keyframe/keyframe_codec.h"
#include "core/keyframe/vehicle_trail.h"
#include "core/scan/ego_box.h"
#include "core/scan/scan_reader.h"

namespace atlas {
namespace {

constexpr double kMaxAhead_s = 60.0;  // what the daemon accepts

// Whether all that returned is the vehicle itself.
bool SeesNothing(const PointCloud& cloud) {
  return std::all_of(cloud.points.begin(), cloud.points.end(),
                     [ego = EgoBox()](const auto& point) { return ego.Contains(point); });
}

KnownPosition KnownPositionOf(const KnownPlace& place) {
  const Eigen::Vector3d um = 1e6 * place.p_world;
  return {std::llround(um.x()), std::llround(um.y()), std::llround(um.z()),
          static_cast<std::uint32_t>(std::llround(1e3 * place.radius_m))};
}

SurveyOptions SurveyOptionsFor(const IngestOptions& options) {
  SurveyOptions survey;
  survey.rings = options.rings;
  survey.sensor_height_m = options.sensor_height_m;
  return survey;
}

// As the daemon would with the first keyframe (docs/protocol.md, "Who may ask for what"), but
// before every scan is read for it. Of a role that is not known here the daemon has the word.
Status CheckMayUpload(const AtlasIdentity& atlas, const std::string& vehicle) {
  const auto deny = [&atlas](const std::string& what) {
    return Status(
        StatusCode::kPermissionDenied,
        StrCat(atlas.our_name.empty() ? "without a certificate or a token" : atlas.our_name,
               ", with the role ", atlas.our_role, ", may not ", what));
  };
  if (atlas.our_role == "reader" || atlas.our_role == "merge") return deny("upload keyframes");
  if (atlas.our_role == "vehicle" && !atlas.our_name.empty() && atlas.our_name != vehicle) {
    return deny(StrCat("upload for the vehicle ", vehicle, " (--vehicle)"));
  }
  return {};
}

class Ingest {
 public:
  Ingest(const DriveFolder& drive, const IngestOptions& options)
      : drive_(drive), options_(options), motion_(drive, options.deskew.revolution_s) {
    for (const DriveScan& scan : drive.scans) {
      poses_.push_back(scan.T_world_sensor);
    }
  }

  Status Prepare(const MapProfile& profile) {
    ATLAS_RETURN_IF_ERROR(options_.Validate());
    ATLAS_RETURN_IF_ERROR(options_.deskew.Validate(drive_));
    ATLAS_RETURN_IF_ERROR(Select());
    ATLAS_RETURN_IF_ERROR(CheckScans());
    Result<DriveSurvey> survey = SurveyDrive(drive_, SurveyOptionsFor(options_));
    if (!survey) return survey.error();
    survey_ = *std::move(survey);
    const auto deskewing = DecideDeskewing(options_.deskew.deskewing, drive_, survey_, motion_);
    if (!deskewing) return deskewing.error();
    report_.deskewing = *deskewing;
    KeyframeBuilderOptions builder_options;
    builder_options.max_range_m = options_.max_range_m;
    builder_options.mount = survey_.mount;
    builder_options.ring_step = survey_.ring_step;
    ATLAS_RETURN_IF_ERROR(builder_options.Validate(profile));
    builder_.emplace(profile, survey_.layout, builder_options);
    report_.mount = survey_.mount;
    NoteSessions();
    if (options_.shuffle_seed) ShuffleScans(selected_, *options_.shuffle_seed);
    return Plan();
  }

  // Keyframes stay what they are: only where they go is another matter.
  Status Anchor(AtlasClient& client) {
    if (!options_.anchor) return {};
    const auto motion = [this](const DriveScan& scan) {
      return MotionOf(static_cast<std::size_t>(&scan - drive_.scans.data()));
    };
    auto anchors = AnchorSessions({drive_, survey_, options_.start_s, motion, options_.positions},
                                  sessions_, *options_.anchor, client);
    if (!anchors) return anchors.error();
    report_.anchors = *std::move(anchors);
    for (const SessionAnchor& anchor : report_.anchors) {
      Frame& frame = frames_[anchor.key];
      frame.is_staged = !anchor.is_anchored();
      if (anchor.is_anchored()) frame.T_map_drive = anchor.part.T_map_drive->ToPose();
    }
    return {};
  }

  // Whoever wants a session staged wants nothing of it in the map.
  Status CheckStaged(AtlasClient& client) const {
    if (!options_.is_staged) return {};
    const auto sessions = client.ListSessions(options_.session.vehicle);
    if (!sessions) return sessions.error();
    for (const SessionSummary& session : *sessions) {
      const bool is_ours = std::any_of(
          planned_.begin(), planned_.end(),
          [&](const PlannedKeyframe& keyframe) { return keyframe.key.session == session.key; });
      if (is_ours && session.state != "staged" && session.state != "retracted") {
        return {StatusCode::kConflict,
                StrCat("session ", session.key, " is there already, and ", session.state,
                       ": what it gets now would not be staged; --session gives it another name")};
      }
    }
    return {};
  }

  Status Run(AtlasLink& link, const LastingUpload::Progress& progress) {
    const auto send = [this](std::size_t i, KeyframeUploader& uploader) {
      return UploadOne(i, uploader);
    };
    LastingUpload upload(planned_, options_.upload, send, progress);
    Status status = upload.Run(link);
    report_.upload = upload.report();
    return status;
  }

  const IngestReport& report() const { return report_; }

 private:
  Status Select() {
    selected_ = SelectScans(drive_, options_.selection);
    report_.keyframes = selected_.size();
    report_.metres = SelectedMetres(drive_, selected_);
    // Parts that are anchored each for itself may lie anywhere in the drive's own frame.
    if (!options_.anchor) {
      JoinImpossibleParts(drive_, selected_);
      report_.impossible_steps = FindImpossibleSteps(drive_, selected_);
    }
    std::set<std::uint32_t> parts;
    for (const SelectedScan& scan : selected_) {
      report_.positions += options_.positions.count(drive_.scans[scan.index].number);
      parts.insert(scan.session_part);
      ATLAS_RETURN_IF_ERROR(KeyOf(scan).Validate());  // "S.12" may be too long a name
    }
    report_.sessions = parts.size();
    return {};
  }

  void NoteSessions() {
    for (const SelectedScan& selected : selected_) {
      const SessionKey key = KeyOf(selected).session;
      const auto known = std::find_if(sessions_.begin(), sessions_.end(),
                                      [&key](const SessionScans& s) { return s.key == key; });
      SessionScans& session = known == sessions_.end()
                                  ? sessions_.emplace_back(SessionScans{key, sessions_.empty(), {}})
                                  : *known;
      session.scans.push_back(&drive_.scans[selected.index]);
    }
  }

  Status Plan() {
    for (const SelectedScan& selected : selected_) {
      const Result<std::int64_t> time_ms = TimeOf(drive_.scans[selected.index]);
      if (!time_ms) return time_ms.error();
      planned_.push_back({KeyOf(selected), *time_ms});
    }
    return {};
  }

  // Reads every scan once before the first is uploaded: a drive with a bad one leaves no trace.
  Status CheckScans() {
    for (const SelectedScan& selected : selected_) {
      const DriveScan& scan = drive_.scans[selected.index];
      const auto cloud = ReadScan(scan.scan);
      if (!cloud) return cloud.error();
      report_.dropped_returns += cloud->dropped.size();
      report_.empty_scans += SeesNothing(*cloud) ? 1U : 0U;
      if (const auto time_ms = TimeOf(scan); !time_ms) return time_ms.error();
    }
    return {};
  }

  KeyframeKey KeyOf(const SelectedScan& selected) const {
    return {{options_.session.vehicle,
             SessionPartName(options_.session.session, selected.session_part)},
            drive_.scans[selected.index].number};
  }

  Result<std::int64_t> TimeOf(const DriveScan& scan) const {
    const double time_s = options_.start_s + ScanTime_s(scan);
    if (!(time_s >= 0.0 && time_s <= options_.now_s + kMaxAhead_s)) {
      return Error(StatusCode::kInvalidData,
                   StrCat("scan ", scan.number, ": time ", time_s,
                          " s since 1970: expected 0 to a minute from now"));
    }
    return std::llround(time_s * 1e3);
  }

  Status UploadOne(std::size_t i, KeyframeUploader& uploader) {
    const std::size_t index = selected_[i].index;
    const Result<PointCloud> cloud = ReadScan(drive_.scans[index].scan);
    if (!cloud) return cloud.error();
    const Bytes blob = BuildBlob(*cloud, index);
    KeyframeUpload upload;
    upload.key = planned_[i].key;
    upload.time_ms = planned_[i].time_ms;
    upload.blob = blob;
    const auto frame = frames_.find(upload.key.session);
    const bool is_of_map = frame == frames_.end();
    const Pose& T_drive_sensor = drive_.scans[index].T_world_sensor;
    upload.T_world_sensor = QuantizedPose::FromPose(
        is_of_map ? T_drive_sensor : frame->second.T_map_drive * T_drive_sensor);
    const auto place = options_.positions.find(upload.key.sequence);
    if (place != options_.positions.end()) upload.prior = KnownPositionOf(place->second);
    upload.is_staged = options_.is_staged || (!is_of_map && frame->second.is_staged);
    return uploader.Upload(upload);
  }

  Bytes BuildBlob(const PointCloud& cloud, std::size_t index) {
    const CpuTimer timer;
    const Eigen::Quaterniond R_world_sensor(drive_.scans[index].T_world_sensor.linear());
    const GridAttitude attitude{SplitYaw(R_world_sensor).R_level_sensor,
                                GridYaw(drive_.scans[index].number)};
    Bytes blob =
        EncodeKeyframe(builder_->Build(cloud, attitude, TrailUntil(index), MotionOf(index)));
    report_.frontend_s += timer.elapsed_s();
    return blob;
  }

  // During a scan that is to be deskewed.
  std::optional<Pose> MotionOf(std::size_t index) const {
    return report_.deskewing.is_deskewed ? std::optional(motion_.During(index)) : std::nullopt;
  }

  // Of the whole drive, whichever scans are selected: a scan's keyframe is always the same.
  std::vector<VehiclePlace> TrailUntil(std::size_t index) const {
    return TrailBefore(std::span(poses_).first(index + 1), builder_->mount());
  }

  const DriveFolder& drive_;
  const IngestOptions& options_;
  const DriveMotion motion_;
  std::vector<Pose> poses_;  // of all scans
  // Where the scans of an anchored session go.
  struct Frame {
    Pose T_map_drive = Pose::Identity();
    bool is_staged = false;
  };

  DriveSurvey survey_;
  std::optional<KeyframeBuilder> builder_;
  std::vector<SessionScans> sessions_;
  std::map<SessionKey, Frame> frames_;  // of anchored ones; others are in the map's frame
  std::vector<SelectedScan> selected_;
  std::vector<PlannedKeyframe> planned_;  // of the selected ones
  IngestReport report_;
};

}  // namespace

Status IngestOptions::Validate() const {
  ATLAS_RETURN_IF_ERROR(session.Validate());
  ATLAS_RETURN_IF_ERROR(SurveyOptionsFor(*this).Validate());
  ATLAS_RETURN_IF_ERROR(deskew.Validate());
  if (anchor) ATLAS_RETURN_IF_ERROR(anchor->Validate());
  if (!(selection.every_m >= 0.0)) {
    return {StatusCode::kInvalidArgument,
            StrCat("every ", selection.every_m, " m: expected 0 or more")};
  }
  if (upload.max_in_flight < 1) {
    return {StatusCode::kInvalidArgument, "batch 0: expected at least one keyframe"};
  }
  return {};
}

Result<IngestReport> IngestDrive(const DriveFolder& drive,
                                 const IngestOptions& options,
                                 AtlasLink& link,
                                 const LastingUpload::Progress& progress) {
  const Result<AtlasClient*> client = link.Client(options.connect_timeout);
  if (!client) return Error(client.error());
  const std::string& vehicle = options.session.vehicle;
  if (Status status = CheckMayUpload((*client)->atlas(), vehicle); !status.ok()) {
    return Error(std::move(status));
  }
  Ingest ingest(drive, options);
  if (Status status = ingest.Prepare((*client)->profile()); !status.ok()) {
    return Error(std::move(status));
  }
  if (Status status = ingest.CheckStaged(**client); !status.ok()) return Error(std::move(status));
  if (Status status = ingest.Anchor(**client); !status.ok()) return Error(std::move(status));
  if (Status status = ingest.Run(link, progress); !status.ok()) return Error(std::move(status));
  return ingest.report();
}

}  // namespace atlas
