#include "tests/data/street_map.h"

#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <utility>

#include "core/base/integer_math.h"
#include "core/fusion/observation/keyframe_placement.h"
#include "core/geometry/nibble.h"
#include "core/keyframe/keyframe_builder.h"
#include "core/tile/column_lattice.h"

namespace atlas::testing {
namespace {

constexpr double kKeyframeSpacing_m = 1.0;

template <typename T>
T Read(Result<T> result) {
  if (!result) {
    throw std::runtime_error(result.error().message());
  }
  return *std::move(result);
}

}  // namespace

StreetMap::StreetMap(const std::filesystem::path& folder, double sensor_height_m)
    : drive_(Read(OpenDriveFolder(folder))), sensor_height_m_(sensor_height_m) {
  SensorLayoutEstimator estimator;
  for (const DriveScan& scan : drive_.scans) {
    clouds_.push_back(Read(ReadScan(scan.scan)));
    estimator.Add(clouds_.back());
  }
  KeyframeBuilderOptions options;
  options.mount.height_m = sensor_height_m;
  const KeyframeBuilder builder(profile_, Read(estimator.Estimate()), options);
  std::map<TileId, std::vector<PlacedKeyframe>> sources;
  const DriveScan* last = nullptr;
  for (std::size_t i = 0; i < clouds_.size(); ++i) {
    const DriveScan& scan = drive_.scans[i];
    if (last != nullptr &&
        (scan.T_world_sensor.translation() - last->T_world_sensor.translation()).norm() <
            kKeyframeSpacing_m) {
      continue;
    }
    last = &scan;
    const YawAndLevel split = SplitYaw(Eigen::Quaterniond(scan.T_world_sensor.linear()));
    const auto keyframe =
        std::make_shared<const Keyframe>(builder.Build(clouds_[i], split.R_level_sensor));
    const KeyframePlacement placement = Read(
        PlaceKeyframe(QuantizedPose::FromPose(scan.T_world_sensor), keyframe->level_quaternion));
    for (const TileId& id : FootprintTiles(placement, keyframe->grid, profile_)) {
      sources[id].push_back(
          {{{"car", "street"}, scan.number}, 100 * scan.number, placement, keyframe});
    }
  }
  for (const auto& [id, keyframes] : sources) {
    tiles_.emplace(id, FuseTile(id, keyframes, profile_));
  }
}

StreetMap::Road StreetMap::RoadAt(double x, double y) const {
  Road road{0.0, std::numeric_limits<double>::infinity()};
  for (const DriveScan& scan : drive_.scans) {
    const Eigen::Vector3d p = scan.T_world_sensor.translation();
    const double distance_m = std::hypot(p.x() - x, p.y() - y);
    if (distance_m < road.distance_m) {
      road = {p.z() - sensor_height_m_, distance_m};
    }
  }
  return road;
}

bool StreetMap::IsOccupied(std::int64_t cell_x,
                           std::int64_t cell_y,
                           double low_m,
                           double high_m) const {
  const std::int64_t side = profile_.tile_cells;
  const TileId id{0, static_cast<std::int32_t>(FloorDiv(cell_x, side)),
                  static_cast<std::int32_t>(FloorDiv(cell_y, side))};
  const auto tile = tiles_.find(id);
  if (tile == tiles_.end() || tile->second.is_empty()) {
    return false;
  }
  const auto cell = static_cast<std::size_t>((cell_y - id.y * side) * side + cell_x - id.x * side);
  for (const TileLayer& layer : tile->second.Layers(cell)) {
    const std::int32_t base = ColumnBaseIndex(layer.altitude_mm, profile_);
    for (int k = 0; k < profile_.column_segments; ++k) {
      const double bottom_m = (base + k) * profile_.segment_height_m();
      if (bottom_m < high_m && bottom_m + profile_.segment_height_m() > low_m &&
          NibbleAt(layer.column, k) > kNibbleUnknown) {
        return true;
      }
    }
  }
  return false;
}

}  // namespace atlas::testing
