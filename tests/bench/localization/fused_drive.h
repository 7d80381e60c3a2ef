// A recorded drive's scans as a map in memory: through the product's own front end, fusion and tile
// codec, without a daemon.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "client/drive/drive_selection.h"
#include "client/drive/drive_survey.h"
#include "client/map/map_source.h"
#include "core/base/status.h"
#include "core/geometry/map_profile.h"
#include "core/scan/drive_folder.h"

namespace atlas::testing {

struct FusedDriveOptions {
  MapProfile profile;
  SelectionOptions selection;
  double max_range_m = 40.0;
};

// Level 0 only; the other levels are empty.
class FusedDrive : public MapSource {
 public:
  // As `atlas ingest` would, each selected scan a keyframe. Errors are those of the drive's files,
  // and kInvalidArgument for a range that no keyframe has.
  static Result<FusedDrive> Fuse(const DriveFolder& drive,
                                 const DriveSurvey& survey,
                                 const FusedDriveOptions& options);

  const MapProfile& profile() const override { return profile_; }
  Status ReadLevel(std::uint8_t level,
                   const std::optional<DiscArea>& disc,
                   const OnTile& on_tile) override;

  std::uint64_t blob_bytes() const;

 private:
  explicit FusedDrive(const MapProfile& profile) : profile_(profile) {}

  MapProfile profile_;
  std::vector<TileBlob> tiles_;
};

}  // namespace atlas::testing
