#include "client/cli/commands/drive/drive_flags.h"

#include <utility>

#include "core/base/str_cat.h"

namespace atlas {

void DriveFlags::Declare(ArgumentSet& arguments, const std::string& contents) {
  arguments.Required("DIR", "DIR", directory_, contents);
  arguments.Optional("--rings", "N", rings_, "Use about so many of the rings [all]");
}

void DriveFlags::DeclareScans(ArgumentSet& arguments) {
  arguments.Choice("--scans", {"even", "odd", "all"}, scans_, "Parity of the scans' numbers");
}

void DriveFlags::DeclareDeskew(ArgumentSet& arguments, const std::string& help) {
  arguments.Choice("--deskew", {"on", "off", "auto"}, deskew_, help);
  arguments.Optional(
      "--revolution", "S", revolution_s_,
      "With --deskew: the sensor turns once in so many seconds [as long as scans are "
      "apart as a rule]; of drives that keep less than each scan");
}

Result<DeskewOptions> DriveFlags::deskew() const {
  const Result<Deskewing> deskewing = ParseDeskewing(deskew_);
  if (!deskewing) return Error(deskewing.error());
  const DeskewOptions options{*deskewing, revolution_s_};
  if (Status status = options.Validate(); !status.ok()) return Error(std::move(status));
  return options;
}

void DriveFlags::DeclareSelection(ArgumentSet& arguments,
                                  double& max_range_m,
                                  const std::string& reach) {
  arguments.Optional("--max-range", "M", max_range_m,
                     StrCat("Reach of ", reach, " [", max_range_m, "]"));
  DeclareScans(arguments);
}

}  // namespace atlas
