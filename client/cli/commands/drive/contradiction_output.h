// `atlas localize --contradictions`: where the drive's scans contradict the map.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <boost/json/object.hpp>

#include "client/cli/command_line/argument_set.h"
#include "client/cli/files/contradiction_file.h"
#include "client/drive/drive_monitor.h"
#include "core/base/status.h"
#include "core/localization/monitor/contradiction.h"

namespace atlas {

class ContradictionOutput {
 public:
  void Declare(ArgumentSet& arguments);

  // Before anything is computed: kInvalidArgument for an unknown ending; kNotFound,
  // kPermissionDenied or kConflict where the file cannot be.
  Status Check();
  bool is_wanted() const { return !file_.empty(); }
  void Add(const Contradiction& contradiction) { found_.push_back(contradiction); }
  // The file whole or not at all. Errors are those of the disk.
  Status Write(double cell_size_m) const;

  // How many of each kind, and what looking for them took.
  boost::json::object Json(const DriveMonitor& monitor) const;
  std::string Text(const DriveMonitor& monitor) const;

 private:
  std::size_t Count(ContradictionKind kind) const;

  std::string file_;
  ContradictionFormat format_ = ContradictionFormat::kCsv;
  std::vector<Contradiction> found_;
};

}  // namespace atlas
