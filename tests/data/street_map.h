// A recorded street, and the tiles of its map as `atlas query -o` wrote them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <vector>

#include "core/geometry/map_profile.h"
#include "core/scan/drive_folder.h"
#include "core/scan/scan_reader.h"
#include "core/tile/tile.h"

namespace atlas::testing {

// World frame, metres; the drive and its map live as long as this does.
class StreetMap {
 public:
  // Default profile. Throws std::runtime_error where the drive or a tile is unreadable.
  StreetMap(const std::filesystem::path& drive,
            const std::filesystem::path& tiles,
            double sensor_height_m);

  const DriveFolder& drive() const { return drive_; }
  const std::vector<PointCloud>& clouds() const { return clouds_; }

  // Height of the road at the pose nearest to (x, y), and how far away that is, horizontally.
  struct Road {
    double z_m = 0.0;
    double distance_m = 0.0;
  };
  Road RoadAt(double x, double y) const;

  // Whether an occupied segment (p > 0.5) of the cell at these indices reaches into (low, high).
  bool IsOccupied(std::int64_t cell_x, std::int64_t cell_y, double low_m, double high_m) const;
  // Whether something stands on a surface of the cell (p > 0.5) between `low_m` and `high_m`.
  bool IsSurfaceOccupied(std::int64_t cell_x,
                         std::int64_t cell_y,
                         double low_m,
                         double high_m) const;

 private:
  std::span<const TileLayer> LayersAt(std::int64_t cell_x, std::int64_t cell_y) const;

  MapProfile profile_;
  DriveFolder drive_;
  std::vector<PointCloud> clouds_;
  double sensor_height_m_;
  std::map<TileId, Tile> tiles_;
};

}  // namespace atlas::testing
