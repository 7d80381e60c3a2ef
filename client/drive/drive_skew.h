// Whether the scans of a recorded drive are as the sensor saw them while it moved, or freed of its
// motion already: what stands around a fast vehicle is drawn from several scans, once as they are
// and once deskewed, and is sharper the right way.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "client/drive/drive_motion.h"
#include "client/drive/drive_survey.h"
#include "core/base/status.h"
#include "core/scan/drive_folder.h"

namespace atlas {

enum class Deskewing { kOff, kOn, kAuto };  // auto: where a drive is found to be skewed

struct DeskewOptions {
  Deskewing deskewing = Deskewing::kOff;
  // The sensor turns once in so long. Not known: as long as two scans are apart as a rule.
  std::optional<double> revolution_s = {};

  // kInvalidArgument naming the first option out of range.
  Status Validate() const;
  // Too: with a revolution times are needed, each later than the one before.
  Status Validate(const DriveFolder& drive) const;
};

struct SkewOptions {
  std::size_t windows = 8;  // of consecutive scans, the fastest ones
  std::size_t window_scans = 8;
  double min_motion_m = 0.3;  // from scan to scan: less blurs nothing that could be measured
  double max_range_m = 25.0;
  double voxel_m = 0.1;  // horizontal
  double voxel_height_m = 0.5;
  // Deskewed, the structure of skewed scans takes so much fewer voxels, and not in one window alone
  // (docs/results.md).
  double min_sharper = 0.01;
  double min_agreeing = 0.75;  // of the windows
};

struct DriveSkew {
  bool is_skewed = false;   // deskewing makes it sharper
  double sharper = 0.0;     // by how much: the share of voxels that it saves; negative: it blurs
  std::size_t windows = 0;  // that were fast enough; 0: nobody knows
  std::size_t sharper_windows = 0;
};

// A function of the folder alone, not of which scans are used. Fails on a scan that cannot be read.
Result<DriveSkew> FindSkew(const DriveFolder& drive,
                           const DriveSurvey& survey,
                           const DriveMotion& motion,
                           const SkewOptions& options = {});

struct DeskewDecision {
  bool is_deskewed = false;
  std::optional<DriveSkew> skew = {};  // what it was decided by, where that was asked for
};
// `motion` of the drive.
Result<DeskewDecision> DecideDeskewing(Deskewing deskewing,
                                       const DriveFolder& drive,
                                       const DriveSurvey& survey,
                                       const DriveMotion& motion);
// "on", "off", "auto".
Result<Deskewing> ParseDeskewing(const std::string& text);

}  // namespace atlas
