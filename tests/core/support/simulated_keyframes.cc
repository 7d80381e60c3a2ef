#include "tests/core/support/simulated_keyframes.h"

#include <span>

#include "core/keyframe/keyframe_builder.h"
#include "core/keyframe/vehicle_trail.h"
#include "core/simulation/simulated_drive.h"

namespace atlas::testing {
namespace {

KeyframeBuilder BuilderFor(const DriveOptions& options, const MapProfile& profile) {
  SensorLayout layout;
  for (const double elevation_rad : options.sensor.elevations_rad) {
    layout.elevation_rad.push_back(static_cast<float>(elevation_rad));
  }
  KeyframeBuilderOptions builder;
  builder.mount.height_m = options.sensor_height_m;
  return {profile, layout, builder};
}

PointCloud CloudOf(const SimulatedScan& scan) {
  PointCloud cloud;
  cloud.points.reserve(scan.points.size());
  for (const SimulatedPoint& p : scan.points) {
    cloud.points.emplace_back(p.x, p.y, p.z);
  }
  return cloud;
}

}  // namespace

DrivenKeyframes DriveThrough(const DrivePiece& piece, const MapProfile& profile) {
  DriveOptions options;
  options.seed = piece.seed;
  options.parked_seed = piece.parked_seed;
  const SimulatedDrive drive =
      SimulatedDrive::Create(MakeWorld(piece.world).value(), options).value();
  const KeyframeBuilder builder = BuilderFor(options, profile);
  DrivenKeyframes driven;
  driven.parked = drive.parked_boxes();
  for (std::size_t i = piece.first; i < piece.first + piece.count; ++i) {
    driven.truth.push_back(drive.sensor_pose(i));
  }
  driven.T_world_sensor = piece.drift ? Drifted(driven.truth, *piece.drift) : driven.truth;
  for (std::size_t i = 0; i < piece.count; ++i) {
    const std::span<const Pose> until(driven.T_world_sensor.data(), i + 1);
    const YawAndLevel split = SplitYaw(Eigen::Quaterniond(until.back().linear()));
    driven.keyframes.push_back(std::make_shared<const Keyframe>(builder.Build(
        CloudOf(drive.Scan(piece.first + i)), {split.R_level_sensor, GridYaw(piece.first + i)},
        TrailBefore(until, builder.mount()))));
  }
  return driven;
}

}  // namespace atlas::testing
