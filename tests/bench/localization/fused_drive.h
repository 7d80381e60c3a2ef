// A recorded drive's scans as a map in memory: through the product's own front end, fusion and tile
// codec, without a daemon.
#pragma once

#include "client/drive/drive_selection.h"
#include "client/drive/drive_survey.h"
#include "core/base/status.h"
#include "core/geometry/map_profile.h"
#include "core/scan/drive_folder.h"
#include "tests/bench/localization/memory_map.h"

namespace atlas::testing {

struct FusedDriveOptions {
  MapProfile profile;
  SelectionOptions selection;
  double max_range_m = 40.0;
};

class FusedDrive : public MemoryMap {
 public:
  // As `atlas ingest` would, each selected scan a keyframe. Errors are those of the drive's files,
  // and kInvalidArgument for a range that no keyframe has.
  static Result<FusedDrive> Fuse(const DriveFolder& drive,
                                 const DriveSurvey& survey,
                                 const FusedDriveOptions& options);

 private:
  using MemoryMap::MemoryMap;
};

}  // namespace atlas::testing
