// Traversable ground found in every scan of a recorded drive, scored where there are labels.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "client/score/curb_score.h"
#include "client/score/segmentation_score.h"
#include "core/base/status.h"
#include "core/scan/drive_folder.h"
#include "core/traversability/segmenter.h"

namespace atlas {

struct DriveSegmentationOptions {
  std::optional<std::uint32_t> rings;
  SegmenterOptions segmenter;
  bool with_curbs = false;  // score kerbs too
};

struct DriveSegmentationReport {
  SegmentationScore score;  // over the scans with labels
  CurbCounts curbs;         // likewise, where asked for
  std::uint64_t scans = 0;
  std::uint64_t ground = 0;  // returns
  std::uint64_t obstacle = 0;
  std::uint64_t dropped = 0;  // entries without a return (scan_reader.h)
  double cpu_s = 0.0;

  double ms_per_scan() const { return scans == 0 ? 0.0 : 1e3 * cpu_s / static_cast<double>(scans); }
};

// `progress` (may be empty) is called with the number of scans done. Fails at the first scan or
// label file that is bad, naming it.
Result<DriveSegmentationReport> SegmentDrive(const DriveFolder& drive,
                                             const DriveSegmentationOptions& options,
                                             const std::function<void(std::size_t)>& progress);

}  // namespace atlas
