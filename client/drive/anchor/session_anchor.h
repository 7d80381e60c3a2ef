// Where the sessions of a drive go in an atlas: the parts of the drive that are new are found in
// its map, those that an earlier run began stay in the frame in which it did.
#pragma once

#include <vector>

#include "client/connection/atlas_client.h"
#include "client/drive/anchor/part_anchor.h"
#include "core/base/status.h"
#include "core/geometry/keyframe_key.h"
#include "core/scan/drive_folder.h"

namespace atlas {

struct AnchoredDrive {
  const DriveFolder& drive;
  const DriveSurvey& survey;
  double start_s = 0.0;          // added to the scans' times
  MotionDuringScan motion = {};  // as its keyframes are deskewed; may be empty
  KnownPlaces positions = {};    // of its scans, in the atlas's frame
};

// A part of the drive, and its scans in their order, not empty.
struct SessionScans {
  SessionKey key;
  bool is_first = false;  // it begins the drive
  std::vector<const DriveScan*> scans;
};

struct SessionAnchor {
  SessionKey key;
  // Nothing but the transform where the session was there already.
  PartAnchor part;
  bool is_resumed = false;

  // Else its keyframes are of the drive's own frame.
  bool is_anchored() const { return part.T_map_drive.has_value(); }
};

// One a session. Waits a minute for what is uploaded to be fused, then takes the map as it is.
// kNotFound: there is no map yet. kConflict: a session of that name has no keyframe of this drive,
// or what comes to it does not lie where its frame puts it.
// kUnsupported: a daemon before 1.10.
Result<std::vector<SessionAnchor>> AnchorSessions(const AnchoredDrive& drive,
                                                  const std::vector<SessionScans>& sessions,
                                                  const AnchorOptions& options,
                                                  AtlasClient& client);

}  // namespace atlas
