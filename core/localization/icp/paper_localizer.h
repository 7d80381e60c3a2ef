// The paper's localization to the letter (III-D and "Vehicle localization in the map"): the scan is
// encoded as columns and decoded to points, so are the map's columns, and ICP matches the ones with
// the others, from where the last scan was found. For comparison beside the Localizer.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/status.h"
#include "core/keyframe/keyframe.h"
#include "core/localization/icp/point_icp.h"
#include "core/localization/icp/point_index.h"
#include "core/localization/window/local_map.h"
#include "core/tile/column_points.h"

namespace atlas {

// The middles of a keyframe's segments whose state is `min_state` or more: levelled frame around
// the sensor, metres.
std::vector<Eigen::Vector3f> DecodeColumns(const Keyframe& keyframe,
                                           const MapProfile& profile,
                                           std::uint8_t min_state = kNibbleObstacle);

struct PaperLocalizerOptions {
  PointIcpOptions icp;
  std::uint8_t min_state = kNibbleObstacle;
  double max_range_m = 40.0;  // the paper's radius
  double margin_m = 12.0;     // beyond it; the map's points are decoded again half-way
};

struct PaperLocalization {
  Pose T_world_sensor = Pose::Identity();
  // Too few points of the scan are near any of the map: the pose is the last one.
  bool is_lost = true;
  double fit = 0.0;  // share of the scan's points that are paired, 0..1
  PointIcpResult icp;
};

class PaperLocalizer {
 public:
  PaperLocalizer(const MapProfile& profile,
                 TilesAround tiles,
                 const PaperLocalizerOptions& options);

  // The next scan is near `T_world_sensor`.
  void Start(const Pose& T_world_sensor);

  // Requires Start(). `scan`: encoded with the map's profile, levelled by `R_level_sensor`. Errors
  // are those of the tiles' source.
  Result<PaperLocalization> Localize(const Keyframe& scan,
                                     const Eigen::Quaterniond& R_level_sensor);

 private:
  Status Renew();

  MapProfile profile_;
  TilesAround tiles_;
  PaperLocalizerOptions options_;
  Pose T_world_sensor_ = Pose::Identity();
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();  // of the index's frame, in the world
  std::optional<PointIndex> map_;
};

}  // namespace atlas
