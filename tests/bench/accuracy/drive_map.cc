#include "tests/bench/accuracy/drive_map.h"

#include <algorithm>
#include <map>
#include <memory>

#include "core/base/str_cat.h"
#include "core/keyframe/keyframe_builder.h"
#include "core/keyframe/vehicle_trail.h"

namespace atlas::testing {
namespace {

constexpr double kSessionJump_m = 10.0;  // as ingest
constexpr std::size_t kLayoutScans = 60;
constexpr std::size_t kMountScans = 24;

PointCloud CloudOf(const SimulatedScan& scan) {
  PointCloud cloud;
  for (const SimulatedPoint& p : scan.points) {
    cloud.points.emplace_back(p.x, p.y, p.z);
  }
  return cloud;
}

Eigen::Quaterniond LevelOf(const Pose& T_world_sensor) {
  return SplitYaw(Eigen::Quaterniond(T_world_sensor.linear())).R_level_sensor;
}

template <typename Use>
void ForSomeScans(std::size_t begin, std::size_t end, std::size_t wanted, const Use& use) {
  const std::size_t count = std::min(wanted, end - begin);
  for (std::size_t i = 0; i < count; ++i) {
    use(begin + i * (end - begin) / count);
  }
}

}  // namespace

Result<KeyframeBuilder> FindBuilder(const SimulatedDrive& drive,
                                    std::size_t begin,
                                    std::size_t end,
                                    const MapProfile& profile,
                                    double range_m) {
  SensorLayoutEstimator estimator;
  ForSomeScans(begin, end, kLayoutScans,
               [&](std::size_t i) { estimator.Add(CloudOf(drive.Scan(i))); });
  const Result<SensorLayout> layout = estimator.Estimate();
  if (!layout) return Error(layout.error());
  KeyframeBuilderOptions options;
  options.max_range_m = range_m;
  SensorMountEstimator mounts;
  ForSomeScans(begin, end, kMountScans, [&](std::size_t i) {
    const Eigen::Quaterniond R_level_sensor = LevelOf(drive.sensor_pose(i));
    mounts.Add(SegmentScan(CloudOf(drive.Scan(i)), *layout, options.ring_step, R_level_sensor,
                           options.segmenter),
               R_level_sensor);
  });
  const Result<SensorMount> mount = mounts.Estimate();
  if (!mount) return Error(mount.error());
  options.mount = *mount;
  if (Status status = options.Validate(profile); !status.ok()) return Error(std::move(status));
  return KeyframeBuilder(profile, *layout, options);
}

Keyframe BuildKeyframe(const KeyframeBuilder& builder, const SimulatedDrive& drive, std::size_t i) {
  constexpr std::size_t kTrailScans = 32;
  std::vector<Pose> poses;
  for (std::size_t k = i - std::min(i, kTrailScans); k <= i; ++k) {
    poses.push_back(drive.sensor_pose(k));
  }
  return builder.Build(CloudOf(drive.Scan(i)), {LevelOf(drive.sensor_pose(i)), GridYaw(i)},
                       TrailBefore(poses, builder.mount()));
}

Result<std::vector<PlacedKeyframe>> BuildKeyframes(const SimulatedDrive& drive,
                                                   std::size_t begin,
                                                   std::size_t end,
                                                   const MapProfile& profile,
                                                   double range_m) {
  end = std::min(end, drive.scans());
  const Result<KeyframeBuilder> builder = FindBuilder(drive, begin, end, profile, range_m);
  if (!builder) return Error(builder.error());
  std::vector<PlacedKeyframe> placed;
  int session = 1;
  for (std::size_t i = begin; i < end; ++i) {
    const Pose& pose = drive.sensor_pose(i);
    if (i > begin &&
        (pose.translation() - drive.sensor_pose(i - 1).translation()).norm() > kSessionJump_m) {
      ++session;
    }
    auto keyframe = std::make_shared<const Keyframe>(BuildKeyframe(*builder, drive, i));
    const auto placement = PlaceKeyframe(QuantizedPose::FromPose(pose), keyframe->level_quaternion);
    if (!placement) return Error(placement.error());
    const KeyframeKey key{{"car", StrCat("drive.", session)}, static_cast<std::uint32_t>(i)};
    const auto time_ms = static_cast<std::int64_t>(drive.time_s(i) * 1e3);
    placed.push_back({key, time_ms, *placement, std::move(keyframe)});
  }
  return placed;
}

DriveMap::DriveMap(const std::vector<PlacedKeyframe>& keyframes, const MapProfile& profile)
    : profile_(profile) {
  std::map<TileId, std::vector<PlacedKeyframe>> by_tile;
  for (const PlacedKeyframe& placed : keyframes) {
    for (const TileId& id : FootprintTiles(placed.placement, placed.keyframe->grid, profile)) {
      by_tile[id].push_back(placed);
    }
  }
  for (const auto& [id, frames] : by_tile) {
    tiles_.emplace(id.Key(), FuseTile(id, frames, profile));
  }
}

const Tile* DriveMap::Find(const TileId& id) const {
  const auto found = tiles_.find(id.Key());
  return found == tiles_.end() ? nullptr : &found->second;
}

std::span<const TileLayer> DriveMap::Layers(const MapCell& cell) const {
  const std::int64_t side = profile_.tile_cells;
  TileId id;
  id.x = static_cast<std::int32_t>(FloorDiv(std::int64_t{cell.x}, side));
  id.y = static_cast<std::int32_t>(FloorDiv(std::int64_t{cell.y}, side));
  const Tile* const tile = Find(id);
  if (tile == nullptr || tile->is_empty()) {
    return {};
  }
  const std::int64_t x = cell.x - id.x * side;
  const std::int64_t y = cell.y - id.y * side;
  return tile->Layers(static_cast<std::size_t>(y * side + x));
}

}  // namespace atlas::testing
