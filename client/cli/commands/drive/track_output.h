// What `atlas localize` leaves on disk: every scan as a line of text, and a picture of the errors.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/cli/command_line/argument_set.h"
#include "client/drive/drive_localization.h"
#include "client/drive/track_file.h"
#include "core/base/status.h"

namespace atlas {

class TrackOutput {
 public:
  // --output and --plot.
  void Declare(ArgumentSet& arguments);

  // Before anything is computed: kInvalidArgument for an unknown ending, or for a trajectory
  // of single shots; kNotFound, kPermissionDenied or kConflict where the files cannot be.
  Status Check(bool is_tracking);
  bool is_wanted() const { return !text_file_.empty() || !plot_file_.empty(); }
  void Add(const LocalizedScan& scan) { scans_.push_back(scan); }
  // Each file whole or not at all. Errors are those of the disk.
  Status Write(const std::string& title) const;

 private:
  Status WritePlot(const std::string& title) const;

  std::string text_file_;
  std::string plot_file_;
  std::optional<TrackFormat> format_;
  bool is_svg_ = false;
  std::vector<LocalizedScan> scans_;
};

}  // namespace atlas
