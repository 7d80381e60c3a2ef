#include "client/drive/drive_segmentation.h"

#include "client/drive/drive_survey.h"
#include "client/score/cpu_timer.h"
#include "core/scan/range_image.h"
#include "core/scan/scan_reader.h"

namespace atlas {
namespace {

Status ScoreScan(const DriveScan& scan,
                 const PointCloud& cloud,
                 const RangeImage& image,
                 const std::vector<std::uint8_t>& is_ground,
                 SegmentationScore& score) {
  if (!scan.label) return {};
  const auto labels = ReadLabels(*scan.label, cloud);
  if (!labels) return labels.error();
  SegmentationCounts counts;
  for (std::size_t i = 0; i < image.size(); ++i) {
    const std::uint32_t source = image.source[i];
    CountReturn(cloud.points[source], (*labels)[source], is_ground[i] != 0, counts);
  }
  score.Add(counts);
  return {};
}

Status SegmentOne(const DriveScan& scan,
                  const DriveSurvey& survey,
                  const Segmenter& segmenter,
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
  for (std::size_t i = 0; i < image.size(); ++i) {
    ++(is_ground[i] != 0 ? report.ground : report.obstacle);
  }
  return ScoreScan(scan, *cloud, image, is_ground, report.score);
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
    if (Status status = SegmentOne(scan, *survey, segmenter, report); !status.ok()) {
      return Error(std::move(status));
    }
    if (progress) progress(report.scans);
  }
  return report;
}

}  // namespace atlas
