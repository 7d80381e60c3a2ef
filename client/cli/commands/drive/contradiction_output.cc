#include "client/cli/commands/drive/contradiction_output.h"

#include <algorithm>

#include "client/cli/files/whole_file.h"
#include "client/cli/output/json_text.h"
#include "client/cli/output/text_table.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

double MillisecondsPerScan(const DriveMonitor& monitor) {
  return monitor.scans() == 0 ? 0.0 : 1e3 * monitor.cpu_s() / static_cast<double>(monitor.scans());
}

}  // namespace

void ContradictionOutput::Declare(ArgumentSet& arguments) {
  arguments.Optional("--contradictions", "FILE.csv|.geojson", file_,
                     "Write where the scans contradict the map: what appeared, vanished, moves");
}

Status ContradictionOutput::Check() {
  if (file_.empty()) return {};
  const Result<ContradictionFormat> format = ContradictionFormatOf(file_);
  if (!format) return format.error();
  format_ = *format;
  return CheckPlace(file_);
}

Status ContradictionOutput::Write(double cell_size_m) const {
  return file_.empty() ? Status()
                       : WriteTextFile(file_, ContradictionText(format_, found_, cell_size_m));
}

std::size_t ContradictionOutput::Count(ContradictionKind kind) const {
  return static_cast<std::size_t>(std::count_if(
      found_.begin(), found_.end(), [kind](const Contradiction& c) { return c.kind == kind; }));
}

boost::json::object ContradictionOutput::Json(const DriveMonitor& monitor) const {
  return {{"appeared", Count(ContradictionKind::kAppeared)},
          {"vanished", Count(ContradictionKind::kVanished)},
          {"moving", Count(ContradictionKind::kMoving)},
          {"scans", monitor.scans()},
          {"ms_per_scan", Rounded(MillisecondsPerScan(monitor), 3)}};
}

std::string ContradictionOutput::Text(const DriveMonitor& monitor) const {
  return StrCat(Count(ContradictionKind::kAppeared), " appeared, ",
                Count(ContradictionKind::kVanished), " vanished, ",
                Count(ContradictionKind::kMoving), " moving; ",
                FixedText(MillisecondsPerScan(monitor), 2), " ms a scan of ", monitor.scans());
}

}  // namespace atlas
