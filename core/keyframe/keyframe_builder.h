// The front end of a vehicle: scan and attitude in, keyframe out (paper III-A, III-B, III-D).
#pragma once

#include <optional>
#include <span>

#include "core/base/status.h"
#include "core/column/column_tracer.h"
#include "core/geometry/map_profile.h"
#include "core/geometry/pose.h"
#include "core/geometry/vehicle_body.h"
#include "core/grid/local_grid.h"
#include "core/keyframe/grid_attitude.h"
#include "core/keyframe/keyframe.h"
#include "core/keyframe/sensor_mount.h"
#include "core/scan/range_image.h"
#include "core/scan/ray_table.h"
#include "core/scan/sensor_layout.h"
#include "core/traversability/segmenter.h"

namespace atlas {

struct KeyframeBuilderOptions {
  double max_range_m = 20.0;  // paper: 20 or 30
  SensorMount mount;
  int ring_step = 1;  // use every ring_step-th channel from the lowest
  SegmenterOptions segmenter;
  ProfileOptions profile;

  // kInvalidArgument naming the first option out of range.
  Status Validate(const MapProfile& map) const;
};

// A segmented, levelled scan: what keyframes are built from and what the localizer matches. With
// `T_now_later`, the sensor's motion during a revolution, it is deskewed.
LeveledScan SegmentScan(const PointCloud& cloud,
                        const SensorLayout& layout,
                        int ring_step,
                        const Eigen::Quaterniond& R_level_sensor,
                        const SegmenterOptions& options,
                        const std::optional<Pose>& T_now_later = std::nullopt);

class KeyframeBuilder {
 public:
  // Requires options.Validate(map).ok().
  KeyframeBuilder(const MapProfile& map,
                  SensorLayout layout,
                  const KeyframeBuilderOptions& options);

  // A scan without a usable return makes a keyframe that has seen nothing. `trail_level`: what the
  // vehicle drove before it (TrailBefore). `T_now_later` as SegmentScan.
  Keyframe Build(const PointCloud& cloud,
                 const GridAttitude& attitude,
                 std::span<const VehiclePlace> trail_level = {},
                 const std::optional<Pose>& T_now_later = std::nullopt) const;

  const SensorMount& mount() const { return options_.mount; }

 private:
  MapProfile map_;
  SensorLayout layout_;
  KeyframeBuilderOptions options_;
  RayTable rays_;
};

}  // namespace atlas
