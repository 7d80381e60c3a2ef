// What `atlas localize` leaves on disk: every scan as a line of text, and a picture of the errors.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/command_line/argument_set.h"
#include "client/drive/drive_localization.h"
#include "client/drive/drive_relocalization.h"
#include "client/drive/track_file.h"
#include "core/base/status.h"

namespace atlas {

enum class LocalizationKind { kTracked, kSingleShots, kRelocalized };

class TrackOutput {
 public:
  // --output and --plot.
  void Declare(ArgumentSet& arguments);

  // Before anything is computed: kInvalidArgument for an unknown ending, or for what there is
  // only of drives that are tracked; kNotFound, kPermissionDenied or kConflict where the files
  // cannot be.
  Status Check(LocalizationKind kind);
  bool is_wanted() const { return !text_file_.empty() || !plot_file_.empty(); }
  void Add(const LocalizedScan& scan) { scans_.push_back(scan); }
  void Add(const RelocalizedScan& scan) { relocalized_.push_back(scan); }
  std::size_t lines() const { return scans_.size() + relocalized_.size(); }
  // Each file whole or not at all. Errors are those of the disk.
  Status Write(const std::string& title) const;
  // "track.csv has what came before, 12 lines".
  std::string Told() const;

 private:
  Status CheckText();
  Status CheckPlot();
  std::string Text() const;
  Status WritePlot(const std::string& title) const;

  std::string text_file_;
  std::string plot_file_;
  std::optional<TrackFormat> format_;
  bool is_svg_ = false;
  LocalizationKind kind_ = LocalizationKind::kTracked;
  std::vector<LocalizedScan> scans_;
  std::vector<RelocalizedScan> relocalized_;
};

}  // namespace atlas
