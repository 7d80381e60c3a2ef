#include "client/cli/commands/drive/relocalization_text.h"

#include <optional>
#include <string>

#include "client/cli/commands/drive/dropped_text.h"
#include "client/cli/output/json_text.h"
#include "client/cli/output/text_table.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

double CpuPerScan(const DriveRelocalizationReport& report) {
  return report.scans == 0 ? 0.0 : report.cpu_s / static_cast<double>(report.scans);
}

// An error over no scan at all is no error of 0.
boost::json::value ErrorJson(const LocalizationScore& score, double error) {
  return score.successes() == 0 ? boost::json::value(nullptr) : Rounded(error, 5);
}

boost::json::value PoseJson(const std::optional<Pose>& pose) {
  if (!pose) return nullptr;
  boost::json::array numbers;
  for (const double number : PoseToRowMajor(*pose)) {
    numbers.emplace_back(number);
  }
  return numbers;
}

}  // namespace

boost::json::object RelocalizedScanJson(const RelocalizedScan& scan) {
  const Relocalization& found = scan.found;
  boost::json::object json{{"type", "scan"},
                           {"scan", scan.scan},
                           {"pose", PoseJson(found.T_world_sensor)},
                           {"health", found.T_world_sensor ? "good" : "lost"},
                           {"margin", Rounded(found.margin, 3)},
                           {"places", found.places.size()}};
  if (!found.places.empty()) {
    json["fit"] = Rounded(found.places.front().registration.fit, 3);
    json["explained"] = Rounded(found.places.front().explained, 3);
    json["error_m"] = Rounded(scan.error.translation_m, 5);
    json["error_deg"] = Rounded(scan.error.rotation_deg, 5);
  }
  return json;
}

boost::json::object RelocalizationJson(const DriveRelocalizationReport& report) {
  return {{"type", "summary"},
          {"scans", report.scans},
          {"dropped_returns", report.dropped_returns},
          {"right", report.right},
          {"wrong", report.wrong},
          {"unknown", report.unknown},
          {"places", report.places},
          {"translation_rmse_m", ErrorJson(report.score, report.score.translation_rmse_m())},
          {"rotation_rmse_deg", ErrorJson(report.score, report.score.rotation_rmse_deg())},
          {"cpu_s_per_scan", Rounded(CpuPerScan(report), 4)},
          {"worst_cpu_s", Rounded(report.worst_cpu_s, 4)}};
}

void PrintRelocalization(const DriveRelocalizationReport& report, std::ostream& out) {
  FactList facts;
  facts.Add("scans", StrCat(report.scans, " in a map of ", report.places, " places"));
  std::string found =
      StrCat(report.right, " within ", FixedText(DriveRelocalizationReport::kRight_m, 1), " m");
  if (report.score.successes() > 0) {
    found += StrCat("; ", FixedText(report.score.translation_rmse_m(), 3), " m, ",
                    FixedText(report.score.rotation_rmse_deg(), 3), " deg RMSE");
  }
  facts.Add("found", found);
  facts.Add("wrong", StrCat(report.wrong));
  facts.Add("don't know", StrCat(report.unknown));
  AddDropped(report.dropped_returns, facts);
  facts.Add("CPU", StrCat(FixedText(CpuPerScan(report), 3), " s a scan, at most ",
                          FixedText(report.worst_cpu_s, 3), " s"));
  facts.Print(out);
}

// The others were looked for and written.
Status CheckReadable(const DriveRelocalizationReport& report) {
  if (report.unreadable.empty()) return {};
  const Status& first = report.unreadable.front().why;
  const std::size_t count = report.unreadable.size();
  return {first.code(), StrCat(count, count == 1 ? " scan" : " scans",
                               " could not be read, the first: ", first.message(), "; of all ",
                               report.scans, " scans ", report.right, " were found, ", report.wrong,
                               " elsewhere than the drive has them")};
}

void NoteUnknown(const DriveRelocalizationReport& report, std::ostream& err) {
  if (report.scans == 0 || report.unknown < report.scans) return;
  err << "note: none of " << report.scans << " scans was found in the map's " << report.places
      << " places: it may be of another place, not have this one yet (atlas wait), or have too "
         "little that tells it from others\n";
}

}  // namespace atlas
