// `atlas segment DIR`: traversable ground in a drive's scans, scored where there are labels.
#include "client/cli/commands/drive/drive_commands.h"
#include "client/cli/commands/drive/drive_flags.h"
#include "client/cli/commands/drive/dropped_text.h"
#include "client/cli/output/json_text.h"
#include "client/cli/output/progress_bar.h"
#include "client/cli/output/text_table.h"
#include "client/drive/drive_segmentation.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

// Null of no cells.
boost::json::value ShareJson(const std::optional<double>& share) {
  return share ? boost::json::value(Rounded(*share, 5)) : boost::json::value(nullptr);
}

std::string ShareText(const std::optional<double>& share, std::uint64_t cells) {
  return share ? StrCat(FixedText(*share, 4), " of ", cells, " cells") : "no such cells";
}

boost::json::object ReportJson(const DriveSegmentationReport& report, bool with_curbs) {
  boost::json::object json;
  if (report.score.scans() > 0) {
    json["precision"] = Rounded(report.score.precision(), 5);
    json["recall"] = Rounded(report.score.recall(), 5);
    json["f1"] = Rounded(report.score.f1(), 5);
  }
  if (with_curbs) {
    json["missed_curb"] = ShareJson(report.curbs.missed_curb());
    json["false_road"] = ShareJson(report.curbs.false_road());
    json["curb_cells"] = report.curbs.curb_cells;
    json["road_cells"] = report.curbs.road_cells;
  }
  json["ground"] = report.ground;
  json["obstacle"] = report.obstacle;
  json["dropped_returns"] = report.dropped;
  json["ms_per_scan"] = Rounded(report.ms_per_scan(), 3);
  json["scans"] = report.scans;
  json["labelled_scans"] = report.score.scans();  // what the score is of
  return json;
}

void PrintReport(const DriveSegmentationReport& report, bool with_curbs, std::ostream& out) {
  FactList facts;
  if (report.score.scans() > 0) {
    facts.Add("precision", FixedText(report.score.precision(), 4));
    facts.Add("recall", FixedText(report.score.recall(), 4));
    facts.Add("F1", FixedText(report.score.f1(), 4));
  }
  if (with_curbs) {
    facts.Add("missed curb", ShareText(report.curbs.missed_curb(), report.curbs.curb_cells));
    facts.Add("false road", ShareText(report.curbs.false_road(), report.curbs.road_cells));
  }
  facts.Add("returns", StrCat(report.ground, " ground, ", report.obstacle, " obstacle"));
  AddDropped(report.dropped, facts);
  facts.Add("scans", StrCat(report.scans, ", of them ", report.score.scans(), " with labels"));
  facts.Add("CPU", FixedText(report.ms_per_scan(), 2) + " ms a scan");
  facts.Print(out);
}

class SegmentCommand : public Command {
 public:
  std::string Name() const override { return "segment"; }
  std::string Summary() const override { return "Find traversable ground in scans, score it"; }

  void Declare(ArgumentSet& arguments) override {
    drive_.Declare(arguments, "velodyne/NNNNNN.bin, poses.txt, optional labels/NNNNNN.label");
    arguments.Optional("--threshold", "T", threshold_m_,
                       StrCat("Distance from a plane that is still ground, metres [",
                              FixedText(threshold_m_, 2), "]"));
    arguments.Flag("--curbs", with_curbs_, "Score kerbs too: the border of road and sidewalk");
    arguments.Choice("--mode", {"paper", "atlas"}, mode_, "The paper's rules, or ours");
  }

  Status Run(CommandContext& context) override {
    const Result<DriveSegmentationOptions> options = Options();
    if (!options) return options.error();
    const Result<DriveFolder> drive = OpenDriveFolder(drive_.directory());
    if (!drive) return drive.error();
    const auto report = Segment(*drive, *options, context);
    if (!report) return report.error();
    if (context.is_json) {
      context.PrintJson(ReportJson(*report, with_curbs_));
    } else {
      PrintReport(*report, with_curbs_, context.out);
    }
    return {};
  }

 private:
  Result<DriveSegmentationOptions> Options() const {
    if (!(threshold_m_ > 0.0 && threshold_m_ <= 1.0)) {
      return Error(StatusCode::kInvalidArgument,
                   StrCat("threshold ", threshold_m_, " m: expected above 0, up to 1"));
    }
    DriveSegmentationOptions options;
    options.rings = drive_.rings();
    options.with_curbs = with_curbs_;
    options.segmenter.mode = mode_ == "paper" ? SegmentMode::kPaper : SegmentMode::kAtlas;
    options.segmenter.threshold_m = static_cast<float>(threshold_m_);
    return options;
  }

  static Result<DriveSegmentationReport> Segment(const DriveFolder& drive,
                                                 const DriveSegmentationOptions& options,
                                                 const CommandContext& context) {
    ProgressBar bar(context.err, context.is_err_terminal, "segment", drive.scans.size());
    return SegmentDrive(drive, options, [&bar](std::size_t done) { bar.Update(done); });
  }

  DriveFlags drive_;
  double threshold_m_ = SegmenterOptions().threshold_m;
  bool with_curbs_ = false;
  std::string mode_ = "atlas";
};

}  // namespace

std::unique_ptr<Command> MakeSegmentCommand() {
  return std::make_unique<SegmentCommand>();
}

}  // namespace atlas
