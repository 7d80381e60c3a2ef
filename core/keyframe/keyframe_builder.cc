#include "core/keyframe/keyframe_builder.h"

#include <algorithm>
#include <cmath>

#include "core/base/str_cat.h"
#include "core/scan/deskew.h"

namespace atlas {
namespace {

constexpr double kMinSensorHeight_m = 0.1;
constexpr double kMaxSensorHeight_m = 10.0;

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
  if (!(sensor_height_m >= kMinSensorHeight_m && sensor_height_m <= kMaxSensorHeight_m)) {
    return Status(StatusCode::kInvalidArgument,
                  StrCat("sensor height is ", sensor_height_m, " m, expected 0.1 to 10"));
  }
  return {};
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
                                const Eigen::Quaterniond& R_level_sensor,
                                const std::optional<Pose>& T_now_later) const {
  const LeveledScan scan = SegmentScan(cloud, layout_, options_.ring_step, R_level_sensor,
                                       options_.segmenter, T_now_later);
  const VehicleContact contact{(R_level_sensor * Eigen::Vector3d::UnitZ()).cast<float>(),
                               static_cast<float>(options_.sensor_height_m)};
  LocalGrid grid = BuildLocalGrid(scan, rays_, contact, WithClearance(options_.profile, map_));
  LocalColumns columns = TraceColumns(scan, rays_, grid.cells,
                                      ColumnOptions::FromProfile(map_, Keyframe::kBlockCells));
  Pose attitude = Pose::Identity();
  attitude.linear() = R_level_sensor.toRotationMatrix();

  Keyframe keyframe;
  keyframe.profile_hash = map_.Hash();
  keyframe.grid = rays_.grid();
  keyframe.level_quaternion = QuantizedPose::FromPose(attitude).quaternion;
  keyframe.sensor_height_mm =
      static_cast<std::int32_t>(std::lround(options_.sensor_height_m * 1e3));
  keyframe.cells = std::move(grid.cells);
  keyframe.columns = std::move(columns.columns);
  keyframe.anchors = std::move(columns.anchors);
  return keyframe;
}

namespace {

// Heights of the sensor above ground returns up to 12 m away and at most `half_width_m` off the
// vehicle's axis.
std::vector<float> HeightsAboveGround(std::span<const LeveledScan> scans, float half_width_m) {
  constexpr float kNear_m = 12.0F;
  std::vector<float> heights_m;
  for (const LeveledScan& scan : scans) {
    for (std::size_t i = 0; i < scan.size(); ++i) {
      if (scan.is_ground[i] != 0 && scan.range_m[i] < kNear_m &&
          std::abs(scan.y[i]) < half_width_m) {
        heights_m.push_back(-scan.z[i]);
      }
    }
  }
  return heights_m;
}

}  // namespace

Result<double> EstimateSensorHeight(std::span<const LeveledScan> scans) {
  constexpr float kLane_m = 1.0F;
  constexpr float kAnywhere_m = 100.0F;
  constexpr std::size_t kEnough = 100;
  std::vector<float> heights_m = HeightsAboveGround(scans, kLane_m);
  if (heights_m.size() < kEnough) {
    heights_m = HeightsAboveGround(scans, kAnywhere_m);
  }
  if (heights_m.empty()) {
    return Error(StatusCode::kInvalidData,
                 "no ground within 12 m in any scan: give the sensor's height");
  }
  const auto median = heights_m.begin() + static_cast<std::ptrdiff_t>(heights_m.size() / 2);
  std::nth_element(heights_m.begin(), median, heights_m.end());
  if (!(*median >= kMinSensorHeight_m && *median <= kMaxSensorHeight_m)) {
    return Error(StatusCode::kInvalidData,
                 StrCat("what looks like ground is ", *median,
                        " m below the sensor, expected 0.1 to 10: give the sensor's height"));
  }
  return static_cast<double>(*median);
}

}  // namespace atlas
