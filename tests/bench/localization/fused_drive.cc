#include "tests/bench/localization/fused_drive.h"

#include <map>
#include <memory>
#include <utility>

#include "core/fusion/tile_fusion.h"
#include "core/keyframe/keyframe_builder.h"
#include "core/keyframe/vehicle_trail.h"
#include "core/scan/scan_reader.h"

namespace atlas::testing {
namespace {

constexpr std::int64_t kScan_ms = 100;

std::vector<Pose> PosesUntil(const DriveFolder& drive, std::size_t index) {
  constexpr std::size_t kTrailScans = 32;
  std::vector<Pose> poses;
  for (std::size_t i = index - std::min(index, kTrailScans); i <= index; ++i) {
    poses.push_back(drive.scans[i].T_world_sensor);
  }
  return poses;
}

Result<PlacedKeyframe> Place(const DriveFolder& drive,
                             const SelectedScan& selected,
                             const KeyframeBuilder& builder) {
  const DriveScan& scan = drive.scans[selected.index];
  const auto cloud = ReadScan(scan.scan);
  if (!cloud) return Error(cloud.error());
  const YawAndLevel split = SplitYaw(Eigen::Quaterniond(scan.T_world_sensor.linear()));
  auto keyframe = std::make_shared<const Keyframe>(
      builder.Build(*cloud, {split.R_level_sensor, GridYaw(drive.scans[selected.index].number)},
                    TrailBefore(PosesUntil(drive, selected.index), builder.mount())));
  const auto placement =
      PlaceKeyframe(QuantizedPose::FromPose(scan.T_world_sensor), keyframe->level_quaternion);
  if (!placement) return Error(placement.error());
  const KeyframeKey key{{"car", SessionPartName("drive", selected.session_part)}, scan.number};
  return PlacedKeyframe{key, kScan_ms * scan.number, *placement, std::move(keyframe)};
}

}  // namespace

Result<FusedDrive> FusedDrive::Fuse(const DriveFolder& drive,
                                    const DriveSurvey& survey,
                                    const FusedDriveOptions& options) {
  KeyframeBuilderOptions builder_options;
  builder_options.max_range_m = options.max_range_m;
  builder_options.mount = survey.mount;
  builder_options.ring_step = survey.ring_step;
  if (Status status = builder_options.Validate(options.profile); !status.ok()) {
    return Error(std::move(status));
  }
  const KeyframeBuilder builder(options.profile, survey.layout, builder_options);
  std::map<TileId, std::vector<PlacedKeyframe>> by_tile;
  for (const SelectedScan& selected : SelectScans(drive, options.selection)) {
    const auto placed = Place(drive, selected, builder);
    if (!placed) return Error(placed.error());
    for (const TileId& id :
         FootprintTiles(placed->placement, placed->keyframe->grid, options.profile)) {
      by_tile[id].push_back(*placed);
    }
  }
  FusedDrive map(options.profile);
  for (const auto& [id, keyframes] : by_tile) {
    map.Add(FuseTile(id, keyframes, options.profile));
  }
  return map;
}

}  // namespace atlas::testing
