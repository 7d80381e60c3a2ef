#include "tests/data/street_map.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <utility>

#include "core/base/integer_math.h"
#include "core/geometry/nibble.h"
#include "core/tile/column_lattice.h"
#include "core/tile/tile_codec.h"

namespace atlas::testing {
namespace {

template <typename T>
T Read(Result<T> result) {
  if (!result) {
    throw std::runtime_error(result.error().message());
  }
  return *std::move(result);
}

Bytes ReadBytes(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

}  // namespace

StreetMap::StreetMap(const std::filesystem::path& drive,
                     const std::filesystem::path& tiles,
                     double sensor_height_m)
    : drive_(Read(OpenDriveFolder(drive))), sensor_height_m_(sensor_height_m) {
  for (const DriveScan& scan : drive_.scans) {
    clouds_.push_back(Read(ReadScan(scan.scan)));
  }
  for (const auto& entry : std::filesystem::directory_iterator(tiles)) {
    Tile tile = Read(DecodeTile(ReadBytes(entry.path()), profile_));
    if (tile.id.level == 0) {
      tiles_.emplace(tile.id, std::move(tile));
    }
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

std::span<const TileLayer> StreetMap::LayersAt(std::int64_t cell_x, std::int64_t cell_y) const {
  const std::int64_t side = profile_.tile_cells;
  const TileId id{0, static_cast<std::int32_t>(FloorDiv(cell_x, side)),
                  static_cast<std::int32_t>(FloorDiv(cell_y, side))};
  const auto tile = tiles_.find(id);
  if (tile == tiles_.end() || tile->second.is_empty()) {
    return {};
  }
  return tile->second.Layers(
      static_cast<std::size_t>((cell_y - id.y * side) * side + cell_x - id.x * side));
}

bool StreetMap::IsOccupied(std::int64_t cell_x,
                           std::int64_t cell_y,
                           double low_m,
                           double high_m) const {
  for (const TileLayer& layer : LayersAt(cell_x, cell_y)) {
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

bool StreetMap::IsSurfaceOccupied(std::int64_t cell_x,
                                  std::int64_t cell_y,
                                  double low_m,
                                  double high_m) const {
  const auto layers = LayersAt(cell_x, cell_y);
  return std::any_of(layers.begin(), layers.end(), [&](const TileLayer& layer) {
    const double z_m = layer.altitude_mm * 1e-3;
    return layer.occupancy > 0 && z_m > low_m && z_m < high_m;
  });
}

}  // namespace atlas::testing
