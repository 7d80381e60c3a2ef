// The places of the atlas where a vehicle may stand, and what they look like: which of them look
// like a scan, without any idea of where it was taken.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <unordered_map>
#include <vector>

#include <Eigen/Core>

#include "core/base/status.h"
#include "core/geometry/map_profile.h"
#include "core/localization/places/block_map.h"
#include "core/localization/places/range_profile.h"
#include "core/tile/tile.h"

namespace atlas {

struct PlaceIndexOptions {
  double block_m = 0.4;
  double spacing_m = 2.0;             // between places on one surface
  double deck_m = 1.0;                // surfaces closer than this are one
  std::uint8_t occupied_nibble = 10;  // p >= 0.61
};

// Where the sensor is for certain; infinite: not known.
struct PlacePrior {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  double radius_m = std::numeric_limits<double>::infinity();  // around `center`, in the plane
  double z_m = 0.0;
  double height_m = std::numeric_limits<double>::infinity();  // either way of `z_m`

  // kInvalidArgument naming the first that is out of range.
  Status Validate() const;
};

// A place that looks like the scan, with the heading in which it does.
struct PlaceCandidate {
  Eigen::Vector3d ground = Eigen::Vector3d::Zero();  // world
  double yaw_rad = 0.0;                              // of the scan's levelled frame in the world
  std::uint32_t difference = 0;                      // of the profiles (Differences)
};

class PlaceIndex {
 public:
  explicit PlaceIndex(const MapProfile& profile, const PlaceIndexOptions& options = {});

  // Level-0 tiles, each once, in any order; then Finish. Others are ignored.
  void Add(const Tile& tile);
  void Finish();

  const BlockMap& blocks() const { return blocks_; }
  std::size_t places() const { return places_.size(); }
  std::size_t memory_bytes() const;

  // The `count` places and headings that look most like `scan`, the best first, no two of them
  // within `apart_m` and 20 degrees of each other; of a sensor that is `sensor_height_m` above the
  // ground. Requires Finish.
  std::vector<PlaceCandidate> Find(const RangeProfile& scan,
                                   double sensor_height_m,
                                   const std::optional<PlacePrior>& prior,
                                   std::size_t count,
                                   double apart_m) const;

 private:
  struct Place {
    Eigen::Vector3d ground;
    RangeProfile profile;
  };

  void AddPlace(const TileLayer& layer, std::int64_t cell_x, std::int64_t cell_y);
  // Places stand for what is around them.
  bool IsNear(const Place& place, double sensor_height_m, const PlacePrior& prior) const;

  MapProfile profile_;
  PlaceIndexOptions options_;
  std::int64_t place_cells_;
  BlockMap blocks_;
  std::unordered_map<std::uint64_t, std::vector<std::size_t>> in_square_;
  std::vector<Place> places_;
};

}  // namespace atlas
