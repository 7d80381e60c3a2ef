// `atlas segment DIR`: traversable ground in a drive's scans, scored where there are labels.
#include "client/cli/commands.h"
#include "client/cli/json_text.h"
#include "client/cli/progress_bar.h"
#include "client/cli/text_table.h"
#include "client/cpu_timer.h"
#include "client/drive_survey.h"
#include "client/segmentation_score.h"
#include "core/base/str_cat.h"
#include "core/scan/range_image.h"
#include "core/scan/scan_reader.h"

namespace atlas {
namespace {

struct SegmentationRun {
  SegmentationScore score;
  std::uint64_t scans = 0;
  std::uint64_t ground = 0;
  std::uint64_t obstacle = 0;
  double cpu_s = 0.0;

  double ms_per_scan() const { return scans == 0 ? 0.0 : 1e3 * cpu_s / static_cast<double>(scans); }
};

Status ScoreScan(const DriveScan& scan,
                 const PointCloud& cloud,
                 const RangeImage& image,
                 const std::vector<std::uint8_t>& is_ground,
                 SegmentationRun& run) {
  if (!scan.label) return {};
  const auto labels = ReadLabels(*scan.label, cloud);
  if (!labels) return labels.error();
  SegmentationCounts counts;
  for (std::size_t i = 0; i < image.size(); ++i) {
    const std::uint32_t source = image.source[i];
    CountReturn(cloud.points[source], (*labels)[source], is_ground[i] != 0, counts);
  }
  run.score.Add(counts);
  return {};
}

Status SegmentOne(const DriveScan& scan,
                  const DriveSurvey& survey,
                  const SegmenterOptions& options,
                  SegmentationRun& run) {
  const Result<PointCloud> cloud = ReadScan(scan.scan);
  if (!cloud) return cloud.error();
  const YawAndLevel attitude = SplitYaw(Eigen::Quaterniond(scan.T_world_sensor.linear()));
  const Eigen::Vector3f up_sensor =
      (attitude.R_level_sensor.conjugate() * Eigen::Vector3d::UnitZ()).cast<float>();
  const CpuTimer timer;
  const RangeImage image = MakeRangeImage(*cloud, survey.layout, survey.ring_step);
  const std::vector<std::uint8_t> is_ground = Segmenter(options).Segment(image, up_sensor);
  run.cpu_s += timer.elapsed_s();
  ++run.scans;
  for (std::size_t i = 0; i < image.size(); ++i) {
    ++(is_ground[i] != 0 ? run.ground : run.obstacle);
  }
  return ScoreScan(scan, *cloud, image, is_ground, run);
}

boost::json::object RunJson(const SegmentationRun& run) {
  boost::json::object json;
  if (run.score.scans() > 0) {
    json["precision"] = Rounded(run.score.precision(), 5);
    json["recall"] = Rounded(run.score.recall(), 5);
    json["f1"] = Rounded(run.score.f1(), 5);
  }
  json["ground"] = run.ground;
  json["obstacle"] = run.obstacle;
  json["ms_per_scan"] = Rounded(run.ms_per_scan(), 3);
  json["scans"] = run.scans;
  return json;
}

void PrintRun(const SegmentationRun& run, std::ostream& out) {
  FactList facts;
  if (run.score.scans() > 0) {
    facts.Add("precision", FixedText(run.score.precision(), 4));
    facts.Add("recall", FixedText(run.score.recall(), 4));
    facts.Add("F1", FixedText(run.score.f1(), 4));
  }
  facts.Add("returns", StrCat(run.ground, " ground, ", run.obstacle, " obstacle"));
  facts.Add("scans", StrCat(run.scans, ", of them ", run.score.scans(), " with labels"));
  facts.Add("CPU", FixedText(run.ms_per_scan(), 2) + " ms a scan");
  facts.Print(out);
}

class SegmentCommand : public Command {
 public:
  std::string Name() const override { return "segment"; }
  std::string Summary() const override { return "Find traversable ground in scans, score it"; }

  void Declare(ArgumentSet& arguments) override {
    arguments.Required("DIR", "DIR", directory_,
                       "velodyne/NNNNNN.bin, poses.txt, optional labels/NNNNNN.label");
    arguments.Optional("--rings", "N", rings_, "Use about so many of the rings [all]");
    arguments.Optional("--threshold", "T", threshold_m_,
                       "Distance from a plane that is still ground, metres [0.12]");
    arguments.Choice("--mode", {"paper", "atlas"}, mode_, "The paper's rules, or ours");
  }

  Status Run(CommandContext& context) override {
    const Result<SegmenterOptions> options = Options();
    if (!options) return options.error();
    const Result<DriveFolder> drive = OpenDriveFolder(directory_);
    if (!drive) return drive.error();
    SurveyOptions survey_options;
    survey_options.rings = rings_;
    const Result<DriveSurvey> survey = SurveySensor(*drive, survey_options);
    if (!survey) return survey.error();
    SegmentationRun run;
    {
      ProgressBar bar(context.err, context.is_err_terminal, "segment", drive->scans.size());
      for (const DriveScan& scan : drive->scans) {
        ATLAS_RETURN_IF_ERROR(SegmentOne(scan, *survey, *options, run));
        bar.Update(run.scans);
      }
    }
    if (context.is_json) {
      context.PrintJson(RunJson(run));
    } else {
      PrintRun(run, context.out);
    }
    return {};
  }

 private:
  Result<SegmenterOptions> Options() const {
    if (!(threshold_m_ > 0.0 && threshold_m_ <= 1.0)) {
      return Error(StatusCode::kInvalidArgument,
                   StrCat("threshold ", threshold_m_, " m: expected above 0, up to 1"));
    }
    SegmenterOptions options;
    options.mode = mode_ == "paper" ? SegmentMode::kPaper : SegmentMode::kAtlas;
    options.threshold_m = static_cast<float>(threshold_m_);
    return options;
  }

  std::string directory_;
  std::optional<std::uint32_t> rings_;
  double threshold_m_ = SegmenterOptions().threshold_m;
  std::string mode_ = "atlas";
};

}  // namespace

std::unique_ptr<Command> MakeSegmentCommand() {
  return std::make_unique<SegmentCommand>();
}

}  // namespace atlas
