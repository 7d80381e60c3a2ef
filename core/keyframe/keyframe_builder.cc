#include "core/keyframe/keyframe_builder.h"

#include <algorithm>
#include <cmath>

#include "core/base/str_cat.h"
#include "core/scan/deskew.h"

namespace atlas {
namespace {

GridGeometry GridFor(const MapProfile& map, double max_range_m) {
  return {map.cell_size_um, static_cast<std::int32_t>(std::ceil(max_range_m / map.cell_size_m()))};
}

ProfileOptions WithClearance(ProfileOptions options, const MapProfile& map) {
  options.vehicle_clearance_m = static_cast<float>(map.vehicle_clearance_mm) * 1e-3F;
  return options;
}

}  // namespace

Status KeyframeBuilderOptions::Validate(const MapProfile& map) const {
  const double radius_cells = max_range_m / map.cell_size_m();
  if (!(max_range_m >= 1.0 && max_range_m <= 100.0 && radius_cells <= 1024.0)) {
    return Status(
        StatusCode::kInvalidArgument,
        StrCat("maximum range is ", max_range_m,
               " m, expected 1 to 100 m and at most 1024 cells of ", map.cell_size_m(), " m"));
  }
  return mount.Validate();
}

LeveledScan SegmentScan(const PointCloud& cloud,
                        const SensorLayout& layout,
                        int ring_step,
                        const Eigen::Quaterniond& R_level_sensor,
                        const SegmenterOptions& options,
                        const std::optional<Pose>& T_now_later) {
  RangeImage image = MakeRangeImage(cloud, layout, ring_step);
  if (T_now_later) {
    Deskew(image, *T_now_later);
  }
  const Eigen::Vector3f up_sensor =
      (R_level_sensor.conjugate() * Eigen::Vector3d::UnitZ()).cast<float>();
  return LevelScan(image, Segmenter(options).Segment(image, up_sensor),
                   R_level_sensor.cast<float>());
}

KeyframeBuilder::KeyframeBuilder(const MapProfile& map,
                                 SensorLayout layout,
                                 const KeyframeBuilderOptions& options)
    : map_(map),
      layout_(std::move(layout)),
      options_(options),
      rays_(GridFor(map, options.max_range_m)) {}

Keyframe KeyframeBuilder::Build(const PointCloud& cloud,
                                const GridAttitude& attitude,
                                std::span<const VehiclePlace> trail_level,
                                const std::optional<Pose>& T_now_later) const {
  const Eigen::Quaterniond R_grid_sensor = attitude.R_grid_sensor();
  const std::vector<VehiclePlace> trail = Turned(trail_level, attitude.yaw_rad);
  const LeveledScan scan = SegmentScan(cloud, layout_, options_.ring_step, R_grid_sensor,
                                       options_.segmenter, T_now_later);
  VehicleContact contact;
  contact.normal = (R_grid_sensor * options_.mount.up).cast<float>();
  contact.sensor_height_m = static_cast<float>(options_.mount.height_m);
  contact.ahead = Eigen::Rotation2Df(static_cast<float>(-attitude.yaw_rad)) * contact.ahead;
  LocalGrid grid =
      BuildLocalGrid(scan, rays_, contact, trail, WithClearance(options_.profile, map_));
  LocalColumns columns = TraceColumns(scan, rays_, grid.cells, contact.Place(), trail,
                                      ColumnOptions::FromProfile(map_, Keyframe::kBlockCells));
  Pose T_grid_sensor = Pose::Identity();
  T_grid_sensor.linear() = R_grid_sensor.toRotationMatrix();

  Keyframe keyframe;
  keyframe.profile_hash = map_.Hash();
  keyframe.grid = rays_.grid();
  keyframe.level_quaternion = QuantizedPose::FromPose(T_grid_sensor).quaternion;
  keyframe.sensor_height_mm = static_cast<std::int32_t>(std::lround(options_.mount.height_m * 1e3));
  keyframe.cells = std::move(grid.cells);
  keyframe.columns = std::move(columns.columns);
  keyframe.anchors = std::move(columns.anchors);
  return keyframe;
}

}  // namespace atlas
