// Worlds of shapes as level-0 tiles, as fusion publishes them after many drives.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "core/localization/localizer.h"
#include "core/localization/places/place_index.h"
#include "core/tile/tile.h"
#include "tests/core/support/shape_world.h"

namespace atlas::testing {

class PaintedMap {
 public:
  PaintedMap();

  // The square of `half_m` around the origin: ground is measured layers, the faces of boxes stand
  // on them as columns. Faces belong on middles of cells: n * 0.1 + 0.05 m.
  void Paint(const ShapeWorld& world, double half_m);
  // One cell's layer above those it has.
  void Put(std::int64_t cell_x, std::int64_t cell_y, const TileLayer& layer);

  const MapProfile& profile() const { return profile_; }
  std::vector<std::shared_ptr<const Tile>> Tiles() const;
  // The same a level or more higher.
  std::vector<std::shared_ptr<const Tile>> TilesOfLevel(std::uint8_t level) const;
  // Gives all tiles, wherever it is asked.
  TilesAround Source() const;
  MapWindow Window(const Eigen::Vector3d& center, double radius_m) const;

 private:
  void PaintCell(const ShapeWorld& world, std::int64_t cell_x, std::int64_t cell_y);

  MapProfile profile_;
  std::map<TileId, std::vector<std::vector<TileLayer>>> cells_;
};

MapWindow Window(const MapProfile& profile,
                 MapWindow::Tiles tiles,
                 const Eigen::Vector3d& center,
                 double radius_m);

// The finished index of its places.
std::shared_ptr<const PlaceIndex> PlacesOf(const PaintedMap& map);

// Free ground that was measured.
TileLayer GroundLayer(double altitude_m);
// The same with a column: a nibble of 15 where a bit of `segments` is set, lowest first.
TileLayer ColumnLayer(double altitude_m, std::uint32_t segments);

// A street along x: houses with gaps on either side, posts at the kerbs, a slight slope.
ShapeWorld Street();
// Two decks 3 m apart in one corner: two walls, pillars in other places on either deck.
ShapeWorld GarageCorner();
// The same yard of three boxes twice, around x = -20 and 20 m.
ShapeWorld TwoYards();
// Two endless walls along x and nothing else.
ShapeWorld Corridor();

// Their maps, painted when first asked for.
const PaintedMap& StreetMap();
const PaintedMap& GarageMap();

// 16 rings, 720 columns.
SyntheticSensor QuickSensor();
// Matches what is within 25 m.
LocalizerOptions QuickOptions();

// How far a levelled pose is off.
struct PoseError {
  double horizontal_m = 0.0;
  double vertical_m = 0.0;
  double angle_rad = 0.0;
};
PoseError ErrorOf(const Pose& pose, const Pose& truth);

}  // namespace atlas::testing
