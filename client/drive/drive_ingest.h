// A recorded drive into an atlas: survey, select, build keyframes, upload them.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/connection/keyframe_uploader.h"
#include "client/drive/anchor/session_anchor.h"
#include "client/drive/drive_selection.h"
#include "client/drive/drive_skew.h"
#include "client/drive/lasting_upload.h"
#include "client/vehicle/atlas_link.h"
#include "core/base/status.h"
#include "core/keyframe/sensor_mount.h"
#include "core/scan/drive_folder.h"
#include "core/scan/position_file.h"

namespace atlas {

struct IngestOptions {
  SessionKey session;  // of the part before the first possible jump
  SelectionOptions selection;
  std::optional<std::uint32_t> rings;
  double max_range_m = 20.0;
  std::optional<double> sensor_height_m;
  DeskewOptions deskew;    // by the drive's own motion
  bool is_staged = false;  // its sessions stay out of the map until somebody publishes them
  // The drive has a frame of its own, and is found in the atlas first. A part that is not, is
  // uploaded staged, in its own frame. None: its frame is the atlas's.
  std::optional<AnchorOptions> anchor;
  // In the atlas's frame, also of an anchored drive and of one in a frame of its own: none is
  // turned or moved. Of the scans that are uploaded these go along.
  KnownPlaces positions = {};
  double start_s = 0.0;  // added to the scans' times
  double now_s = 0.0;    // since 1970: later scans than a minute from now are refused
  std::optional<std::uint64_t> shuffle_seed;
  UploadOptions upload = {.patience = std::chrono::minutes(1)};
  std::chrono::milliseconds connect_timeout{5'000};  // for the first connection

  // kInvalidArgument naming the first option out of range, those aside that depend on the atlas.
  Status Validate() const;
};

struct IngestReport {
  std::uint64_t keyframes = 0;        // selected
  std::uint64_t empty_scans = 0;      // of those: without a return from beyond the vehicle
  std::uint64_t dropped_returns = 0;  // of those: entries without one (scan_reader.h)
  std::uint64_t positions = 0;        // of those: with a position from elsewhere
  LastingUploadReport upload;
  double metres = 0.0;
  double frontend_s = 0.0;  // CPU time from scan to blob
  SensorMount mount;
  DeskewDecision deskewing;
  std::uint64_t sessions = 0;
  std::vector<std::string> impossible_steps;  // impossible_steps.h
  std::vector<SessionAnchor> anchors;         // of each session, if that was asked for
};

// `progress` (may be empty) is called with the number of keyframes sent. A scan that is bad is
// named and nothing is uploaded. A daemon that is busy is waited for, a connection that breaks is
// made again, both for as long as the patience; what an interrupted run left with the daemon is not
// made and sent again (lasting_upload.h). An anchored drive's session that is there is gone on with
// in the frame that it has there. Fails at once where the daemon cannot be reached at all or takes
// nothing of this vehicle from this client (kPermissionDenied), or where a session that is to be
// staged is there and not staged (kConflict), and at the first keyframe that it refuses otherwise,
// naming it; what was acknowledged until then stays.
Result<IngestReport> IngestDrive(const DriveFolder& drive,
                                 const IngestOptions& options,
                                 AtlasLink& link,
                                 const LastingUpload::Progress& progress);

}  // namespace atlas
