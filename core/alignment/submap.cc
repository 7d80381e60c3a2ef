#include "core/alignment/submap.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "core/base/str_cat.h"
#include "core/fusion/tile_fusion.h"
#include "core/keyframe/grid_attitude.h"
#include "core/localization/places/block_map.h"
#include "core/tile/column_points.h"
#include "core/tile/tile_codec.h"

namespace atlas {
namespace {

Result<std::vector<PlacedKeyframe>> Placed(std::span<const SubmapMember> members,
                                           const Pose& T_submap_world) {
  std::vector<PlacedKeyframe> placed;
  placed.reserve(members.size());
  for (const SubmapMember& member : members) {
    auto placement = PlaceKeyframe(QuantizedPose::FromPose(T_submap_world * member.T_world_sensor),
                                   member.keyframe->level_quaternion);
    if (!placement) {
      return Error(placement.error().WithContext(StrCat("keyframe ", member.key)));
    }
    placed.push_back({member.key, member.time_ms, *placement, member.keyframe});
  }
  return placed;
}

}  // namespace

Pose SubmapFrame(std::span<const Pose> T_world_sensor, std::uint64_t number) {
  const Pose& middle = T_world_sensor[T_world_sensor.size() / 2];
  const YawAndLevel attitude = SplitYaw(Eigen::Quaterniond(middle.linear()));
  Pose T_world_submap = Pose::Identity();
  T_world_submap.translation() = middle.translation();
  T_world_submap.linear() =
      Eigen::AngleAxisd(attitude.yaw_rad + GridYaw(number), Eigen::Vector3d::UnitZ())
          .toRotationMatrix();
  return T_world_submap;
}

Pose SubmapFrame(std::span<const SubmapMember> members, std::uint64_t number) {
  std::vector<Pose> T_world_sensor;
  for (const SubmapMember& member : members) {
    T_world_sensor.push_back(member.T_world_sensor);
  }
  return SubmapFrame(T_world_sensor, number);
}

Result<Submap> Submap::Fuse(std::span<const SubmapMember> members,
                            std::uint64_t number,
                            const MapProfile& profile,
                            const SubmapOptions& options) {
  const Pose T_submap_world = SubmapFrame(members, number).inverse();
  const auto placed = Placed(members, T_submap_world);
  if (!placed) return Error(placed.error());
  std::set<TileId> ids;
  Submap submap;
  for (const PlacedKeyframe& keyframe : *placed) {
    const GridGeometry& grid = keyframe.keyframe->grid;
    const std::vector<TileId> touched = FootprintTiles(keyframe.placement, grid, profile);
    ids.insert(touched.begin(), touched.end());
    const double away_m = 1e-6 * std::hypot(static_cast<double>(keyframe.placement.x_um),
                                            static_cast<double>(keyframe.placement.y_um));
    submap.radius_m_ = std::max(submap.radius_m_, away_m + grid.radius_cells * grid.cell_size_m());
  }
  MapProfile rules = profile;
  rules.sigma_interpolated_mm = options.interpolated_mm;
  rules.sigma_extrapolated_mm = std::max(options.interpolated_mm, profile.sigma_extrapolated_mm);
  Tiles tiles;
  for (const TileId& id : ids) {
    Tile tile = FuseTile(id, *placed, rules);
    if (tile.is_empty()) continue;
    submap.blobs_.push_back(EncodeTile(tile, profile).blob);
    tiles.push_back(std::make_shared<const Tile>(std::move(tile)));
  }
  submap.ExtractFeatures(tiles, profile, options);
  submap.DescribePlaces(members, T_submap_world, tiles, profile, options);
  return submap;
}

Result<Submap::Tiles> Submap::DecodeTiles(const MapProfile& profile) const {
  Tiles tiles;
  tiles.reserve(blobs_.size());
  for (const Bytes& blob : blobs_) {
    Result<Tile> tile = DecodeTile(blob, profile);
    if (!tile) return Error(tile.error());
    tiles.push_back(std::make_shared<const Tile>(*std::move(tile)));
  }
  return tiles;
}

// A place every so far along the way: below the sensor, by its keyframe's own word.
void Submap::DescribePlaces(std::span<const SubmapMember> members,
                            const Pose& T_submap_world,
                            const Tiles& tiles,
                            const MapProfile& profile,
                            const SubmapOptions& options) {
  BlockMap blocks(profile, options.block_m, options.occupied_nibble);
  for (const auto& tile : tiles) {
    blocks.Add(*tile);
  }
  for (const SubmapMember& member : members) {
    Eigen::Vector3d ground = T_submap_world * Eigen::Vector3d(member.T_world_sensor.translation());
    ground.z() -= 1e-3 * member.keyframe->sensor_height_mm;
    const bool is_near = !places_.empty() && (places_.back().ground - ground).head<2>().norm() <
                                                 options.place_spacing_m;
    if (!is_near) places_.push_back({ground, ProfileAt(blocks, ground)});
  }
}

void Submap::ExtractFeatures(const Tiles& tiles,
                             const MapProfile& profile,
                             const SubmapOptions& options) {
  constexpr std::uint8_t kDriveable = TileLayer::kTraversable | TileLayer::kMeasured;
  FeatureExtractor extractor(options.features);
  extractor.Begin();
  for (const auto& tile : tiles) {
    for (const ColumnPoint& point : DecodeColumns(*tile, profile, options.occupied_nibble)) {
      extractor.AddObstacle(point.p_world.cast<float>());
    }
    const auto side = static_cast<std::size_t>(profile.tile_cells);
    const double cell_m = profile.cell_size_m();
    for (std::size_t cell = 0; cell < side * side; ++cell) {
      for (const TileLayer& layer : tile->Layers(cell)) {
        if ((layer.flags & kDriveable) != kDriveable) continue;
        const Eigen::Vector3d p(
            tile->id.x * profile.tile_size_m() + (static_cast<double>(cell % side) + 0.5) * cell_m,
            tile->id.y * profile.tile_size_m() + (static_cast<double>(cell / side) + 0.5) * cell_m,
            1e-3 * layer.altitude_mm);
        extractor.AddGround(p.cast<float>());
      }
    }
  }
  features_ = extractor.Finish();
}

}  // namespace atlas
