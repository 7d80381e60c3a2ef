#include "client/cli/commands/drive/localization_text.h"

#include <string>

#include "client/cli/commands/drive/deskew_text.h"
#include "client/cli/commands/drive/dropped_text.h"
#include "client/cli/output/json_text.h"
#include "client/cli/output/text_table.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

// An error over no shot at all is no error of 0.
boost::json::value ErrorJson(const LocalizationScore& score, double error) {
  return score.successes() == 0 ? boost::json::value(nullptr) : Rounded(error, 5);
}

}  // namespace

boost::json::object LocalizedScanJson(const LocalizedScan& scan) {
  boost::json::array pose;
  for (const double number : PoseToRowMajor(scan.located.T_world_sensor)) {
    pose.emplace_back(number);
  }
  boost::json::value cover;
  if (scan.located.cover) cover = MapCoverName(*scan.located.cover);
  return {{"type", "scan"},
          {"scan", scan.scan},
          {"trial", scan.trial},
          {"pose", std::move(pose)},
          {"health", LocalizationHealthName(scan.located.health)},
          {"map", std::move(cover)},
          {"error_m", Rounded(scan.error.translation_m, 5)},
          {"error_deg", Rounded(scan.error.rotation_deg, 5)}};
}

boost::json::object LocalizationJson(const DriveLocalizationReport& report,
                                     std::uint64_t bytes_received) {
  boost::json::object json{
      {"type", "summary"},
      {"translation_rmse_m", ErrorJson(report.score, report.score.translation_rmse_m())},
      {"rotation_rmse_deg", ErrorJson(report.score, report.score.rotation_rmse_deg())},
      {"translation_p95_m", ErrorJson(report.score, report.score.translation_p95_m())},
      {"failures", report.score.failures()},
      {"lost", report.score.lost()},
      {"good", report.good},
      {"weak", report.weak},
      {"good_failures", report.good_failures},
      {"restarts", report.restarts},
      {"scans", report.scans},
      {"dropped_returns", report.dropped_returns},
      {"shots", report.score.shots()},
      {"hz", Rounded(report.hz(), 2)},
      {"bytes_received", bytes_received}};
  if (report.deskewing.skew) json["deskew"] = DeskewJson(report.deskewing);
  return json;
}

void PrintLocalization(const DriveLocalizationReport& report,
                       std::uint64_t bytes_received,
                       std::ostream& out) {
  const LocalizationScore& score = report.score;
  FactList facts;
  facts.Add("scans", StrCat(report.scans, ", ", score.shots(), " localizations, ", report.restarts,
                            " restarts"));
  facts.Add("error", score.successes() == 0
                         ? std::string("no localization succeeded")
                         : StrCat(FixedText(score.translation_rmse_m(), 3), " m, ",
                                  FixedText(score.rotation_rmse_deg(), 3), " deg RMSE; ",
                                  FixedText(score.translation_p95_m(), 3), " m at 95 %"));
  facts.Add("failures", StrCat(score.failures(), ", of them ", score.lost(), " lost and ",
                               report.good_failures, " called good"));
  facts.Add("health",
            StrCat(report.good, " good, ", report.weak, " weak, ", score.lost(), " lost"));
  AddDropped(report.dropped_returns, facts);
  if (report.deskewing.skew) facts.Add("deskew", DeskewText(report.deskewing));
  facts.Add("speed", FixedText(report.hz(), 1) + " scans a CPU second");
  facts.Add("received", BytesText(bytes_received));
  facts.Print(out);
}

// The others were localized and written; a summary on stdout would be one of what was asked for.
Status CheckReadable(const DriveLocalizationReport& report) {
  if (report.unreadable.empty()) return {};
  const Status& first = report.unreadable.front().why;
  const std::size_t count = report.unreadable.size();
  const LocalizationScore& score = report.score;
  const std::string others = score.successes() == 0
                                 ? StrCat("; none of all ", report.scans, " scans was localized")
                                 : StrCat("; of all ", report.scans, " scans ", score.failures(),
                                          " failed with that, of the others the error is ",
                                          FixedText(score.translation_rmse_m(), 3), " m RMSE");
  return {first.code(), StrCat(count, count == 1 ? " scan" : " scans",
                               " could not be read, the first: ", first.message(), others)};
}

void NoteLost(const DriveLocalizationReport& report, bool is_tracked, std::ostream& err) {
  const LocalizationScore& score = report.score;
  if (score.shots() == 0) return;
  if (is_tracked && report.good == 0 && score.lost() < score.shots()) {
    err << "note: none of " << report.scans
        << " scans is good: what is mapped there does not tell whether the drive is there; "
           "--prior-radius and --prior-height say how surely its poses.txt knows where it begins\n";
    return;
  }
  if (score.lost() < score.shots()) return;
  err << "note: none of " << report.scans
      << " scans was localized, all are lost: the map may be of another place, or not have this "
         "one yet (atlas wait), or "
      << (is_tracked ? "the drive begins elsewhere in it than its poses.txt says"
                     : "the starts are too far off (--perturb)")
      << "; --relocalize looks for each scan in the whole map\n";
}

}  // namespace atlas
