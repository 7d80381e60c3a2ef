// The arguments that commands on recorded drives share.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "client/cli/command_line/argument_set.h"
#include "client/drive/drive_selection.h"
#include "client/drive/drive_skew.h"
#include "core/base/status.h"

namespace atlas {

class DriveFlags {
 public:
  // DIR and --rings. `contents`: what the folder must hold.
  void Declare(ArgumentSet& arguments, const std::string& contents);
  void DeclareScans(ArgumentSet& arguments);  // --scans
  // --scans, and --max-range, whose default `max_range_m` holds; `reach`: of what.
  void DeclareSelection(ArgumentSet& arguments, double& max_range_m, const std::string& reach);

  void DeclareDeskew(ArgumentSet& arguments, const std::string& help);  // and --revolution

  const std::string& directory() const { return directory_; }
  const std::optional<std::uint32_t>& rings() const { return rings_; }
  Result<ScanParity> parity() const { return ParseScanParity(scans_); }
  Result<DeskewOptions> deskew() const;

 private:
  std::string directory_;
  std::optional<std::uint32_t> rings_;
  std::string scans_ = "all";
  std::string deskew_ = "off";
  std::optional<double> revolution_s_;
};

}  // namespace atlas
