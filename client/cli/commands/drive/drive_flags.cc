#include "client/cli/commands/drive/drive_flags.h"

#include "core/base/str_cat.h"

namespace atlas {

void DriveFlags::Declare(ArgumentSet& arguments, const std::string& contents) {
  arguments.Required("DIR", "DIR", directory_, contents);
  arguments.Optional("--rings", "N", rings_, "Use about so many of the rings [all]");
}

void DriveFlags::DeclareScans(ArgumentSet& arguments) {
  arguments.Choice("--scans", {"even", "odd", "all"}, scans_, "Parity of the scans' numbers");
}

void DriveFlags::DeclareSelection(ArgumentSet& arguments,
                                  double& max_range_m,
                                  const std::string& reach) {
  arguments.Optional("--max-range", "M", max_range_m,
                     StrCat("Reach of ", reach, " [", max_range_m, "]"));
  DeclareScans(arguments);
}

}  // namespace atlas
