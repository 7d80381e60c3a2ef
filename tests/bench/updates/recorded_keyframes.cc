#include "tests/bench/updates/recorded_keyframes.h"

#include <memory>
#include <optional>

#include "client/drive/drive_survey.h"
#include "core/keyframe/keyframe_builder.h"
#include "core/keyframe/vehicle_trail.h"
#include "core/scan/drive_folder.h"
#include "core/scan/scan_reader.h"

namespace atlas::testing {
namespace {

constexpr double kSpacing_m = 1.0;
constexpr std::uint32_t kRings = 16;
constexpr std::int64_t kScan_ms = 100;

Result<KeyframeBuilder> BuilderFor(const DriveFolder& drive, const MapProfile& profile) {
  SurveyOptions survey_options;
  survey_options.rings = kRings;
  const auto survey = SurveyDrive(drive, survey_options);
  if (!survey) return Error(survey.error());
  KeyframeBuilderOptions options;
  options.ring_step = survey->ring_step;
  options.mount = survey->mount;
  return KeyframeBuilder(profile, survey->layout, options);
}

}  // namespace

Result<std::vector<PlacedKeyframe>> ReadKeyframes(const std::filesystem::path& folder,
                                                  const MapProfile& profile) {
  const auto drive = OpenDriveFolder(folder);
  if (!drive) return Error(drive.error());
  const auto builder = BuilderFor(*drive, profile);
  if (!builder) return Error(builder.error());
  std::vector<PlacedKeyframe> placed;
  std::optional<Eigen::Vector3d> last;
  std::vector<Pose> poses;
  for (const DriveScan& scan : drive->scans) {
    const Pose& pose = scan.T_world_sensor;
    poses.push_back(pose);
    if (last && (pose.translation() - *last).norm() < kSpacing_m) {
      continue;
    }
    last = pose.translation();
    const auto cloud = ReadScan(scan.scan);
    if (!cloud) return Error(cloud.error());
    const YawAndLevel split = SplitYaw(Eigen::Quaterniond(pose.linear()));
    auto keyframe = std::make_shared<const Keyframe>(
        builder->Build(*cloud, {split.R_level_sensor, GridYaw(scan.number)},
                       TrailBefore(poses, builder->mount())));
    const auto placement = PlaceKeyframe(QuantizedPose::FromPose(pose), keyframe->level_quaternion);
    if (!placement) return Error(placement.error());
    placed.push_back(
        {{{"car", "drive"}, scan.number}, kScan_ms * scan.number, *placement, std::move(keyframe)});
  }
  return placed;
}

}  // namespace atlas::testing
