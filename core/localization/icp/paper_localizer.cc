#include "core/localization/icp/paper_localizer.h"

#include <utility>

namespace atlas {

std::vector<Eigen::Vector3f> DecodeColumns(const Keyframe& keyframe,
                                           const MapProfile& profile,
                                           std::uint8_t min_state) {
  const GridGeometry& grid = keyframe.grid;
  const auto cell_m = static_cast<float>(grid.cell_size_m());
  const auto segment_m = static_cast<float>(profile.segment_height_m());
  std::vector<Eigen::Vector3f> points;
  for (std::int32_t iy = -grid.radius_cells; iy < grid.radius_cells; ++iy) {
    for (std::int32_t ix = -grid.radius_cells; ix < grid.radius_cells; ++ix) {
      const std::uint64_t column = keyframe.columns[grid.Index(ix, iy)];
      if (column == 0) continue;
      const int anchor = keyframe.anchors[keyframe.BlockIndex(ix, iy)];
      for (int segment = 0; segment < profile.column_segments; ++segment) {
        if (NibbleAt(column, segment) < min_state) continue;
        points.emplace_back((static_cast<float>(ix) + 0.5F) * cell_m,
                            (static_cast<float>(iy) + 0.5F) * cell_m,
                            (static_cast<float>(anchor + segment) + 0.5F) * segment_m);
      }
    }
  }
  return points;
}

PaperLocalizer::PaperLocalizer(const MapProfile& profile,
                               TilesAround tiles,
                               const PaperLocalizerOptions& options)
    : profile_(profile), tiles_(std::move(tiles)), options_(options) {}

void PaperLocalizer::Start(const Pose& T_world_sensor) {
  T_world_sensor_ = T_world_sensor;
}

Status PaperLocalizer::Renew() {
  const Eigen::Vector3d center = T_world_sensor_.translation();
  if (map_ && (center - origin_).norm() < 0.5 * options_.margin_m) return {};
  const auto tiles = tiles_(center, options_.max_range_m + options_.margin_m);
  if (!tiles) return tiles.error();
  std::vector<Eigen::Vector3f> points;
  for (const auto& tile : *tiles) {
    for (const ColumnPoint& point : DecodeColumns(*tile, profile_, options_.min_state)) {
      points.push_back((point.p_world - center).cast<float>());
    }
  }
  map_.emplace(std::move(points));
  origin_ = center;
  return {};
}

Result<PaperLocalization> PaperLocalizer::Localize(const Keyframe& scan,
                                                   const Eigen::Quaterniond& R_level_sensor) {
  if (Status status = Renew(); !status.ok()) return Error(std::move(status));
  const std::vector<Eigen::Vector3f> points = DecodeColumns(scan, profile_, options_.min_state);
  Pose start = T_world_sensor_;  // of the levelled frame: the heading is the last one
  start.translation() -= origin_;
  const double yaw_rad = SplitYaw(Eigen::Quaterniond(start.linear())).yaw_rad;
  start.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  PaperLocalization result;
  result.icp = AlignPoints(*map_, points, start, options_.icp);
  result.is_lost = result.icp.pairs < options_.icp.min_pairs;
  result.fit = points.empty()
                   ? 0.0
                   : static_cast<double>(result.icp.pairs) / static_cast<double>(points.size());
  T_world_sensor_ = result.icp.T_map_scan;
  T_world_sensor_.translation() += origin_;
  T_world_sensor_.linear() *= R_level_sensor.toRotationMatrix();
  result.T_world_sensor = T_world_sensor_;
  return result;
}

}  // namespace atlas
