#include "client/drive/drive_segmentation.h"

#include "client/drive/drive_survey.h"
#include "client/score/cpu_timer.h"
#include "core/base/str_cat.h"
#include "core/scan/range_image.h"
#include "core/scan/scan_reader.h"

namespace atlas {
namespace {

// A scan that has been segmented.
struct SegmentedScan {
  const PointCloud& cloud;
  const RangeImage& image;
  const std::vector<std::uint8_t>& is_ground;
  Eigen::Quaternionf R_level_sensor;
};

void ScoreReturns(const SegmentedScan& scan,
                  const std::vector<std::uint32_t>& labels,
                  SegmentationScore& score) {
  SegmentationCounts counts;
  for (std::size_t i = 0; i < scan.image.size(); ++i) {
    const std::uint32_t source = scan.image.source[i];
    CountReturn(scan.cloud.points[source], labels[source], scan.is_ground[i] != 0, counts);
  }
  score.Add(counts);
}

void ScoreCurbs(const SegmentedScan& scan,
                const std::vector<std::uint32_t>& labels,
                CurbCounts& curbs) {
  std::vector<Eigen::Vector3f> p_level;
  for (const Eigen::Vector3f& p : scan.cloud.points) {
    p_level.push_back(scan.R_level_sensor * p);
  }
  std::vector<JudgedReturn> judged;
  for (std::size_t i = 0; i < scan.image.size(); ++i) {
    judged.push_back({scan.image.source[i], scan.is_ground[i] != 0});
  }
  CountCurbs(p_level, labels, judged, curbs);
}

Status SegmentOne(const DriveScan& scan,
                  const DriveSurvey& survey,
                  const Segmenter& segmenter,
                  bool with_curbs,
                  DriveSegmentationReport& report) {
  const Result<PointCloud> cloud = ReadScan(scan.scan);
  if (!cloud) return cloud.error();
  const YawAndLevel attitude = SplitYaw(Eigen::Quaterniond(scan.T_world_sensor.linear()));
  const Eigen::Vector3f up_sensor =
      (attitude.R_level_sensor.conjugate() * Eigen::Vector3d::UnitZ()).cast<float>();
  const CpuTimer timer;
  const RangeImage image = MakeRangeImage(*cloud, survey.layout, survey.ring_step);
  const std::vector<std::uint8_t> is_ground = segmenter.Segment(image, up_sensor);
  report.cpu_s += timer.elapsed_s();
  ++report.scans;
  report.dropped += cloud->dropped.size();
  for (std::size_t i = 0; i < image.size(); ++i) {
    ++(is_ground[i] != 0 ? report.ground : report.obstacle);
  }
  if (!scan.label) return {};
  const auto labels = ReadLabels(*scan.label, *cloud);
  if (!labels) return labels.error();
  const SegmentedScan segmented{*cloud, image, is_ground, attitude.R_level_sensor.cast<float>()};
  ScoreReturns(segmented, *labels, report.score);
  if (with_curbs) ScoreCurbs(segmented, *labels, report.curbs);
  return {};
}

}  // namespace

Result<DriveSegmentationReport> SegmentDrive(const DriveFolder& drive,
                                             const DriveSegmentationOptions& options,
                                             const std::function<void(std::size_t)>& progress) {
  SurveyOptions survey_options;
  survey_options.rings = options.rings;
  const Result<DriveSurvey> survey = SurveySensor(drive, survey_options);
  if (!survey) return Error(survey.error());
  const Segmenter segmenter(options.segmenter);
  DriveSegmentationReport report;
  for (const DriveScan& scan : drive.scans) {
    if (Status status = SegmentOne(scan, *survey, segmenter, options.with_curbs, report);
        !status.ok()) {
      return Error(std::move(status));
    }
    if (progress) progress(report.scans);
  }
  if (options.with_curbs && report.score.scans() == 0) {
    return Error(StatusCode::kNotFound,
                 StrCat(drive.path.string(), ": no labels, which kerbs are found from"));
  }
  return report;
}

}  // namespace atlas
