// The ground of a city: one smooth surface through all passes, with a street along each.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Geometry>

#include "core/simulation/city/city_path.h"
#include "core/simulation/worlds/mesh_builder.h"

namespace atlas {

// The street's cross-section, by distance from the nearest pass.
struct CityStreet {
  static constexpr double kLaneEdge_m = 3.5;  // road; then a parking strip
  static constexpr double kCurb_m = 5.5;      // then a sidewalk
  static constexpr double kSidewalkEdge_m = 8.0;
  static constexpr double kEdge_m = 36.0;  // terrain ends here
  static constexpr double kCurbHeight_m = 0.12;
};

struct GroundPoint {
  double street_m = 0.0;  // to the nearest pass, in plan
  double road_z_m = 0.0;  // the smooth surface; curbs and what is beyond stand 0.12 m above it

  bool is_ground() const { return street_m < CityStreet::kEdge_m; }
  double z_m() const {
    return road_z_m + (street_m > CityStreet::kCurb_m ? CityStreet::kCurbHeight_m : 0.0);
  }
};

// The ground within a square, and somewhat around it: the same numbers whichever square is asked.
class CityGround {
 public:
  // `path` must outlive it.
  CityGround(const CityPath& path, const Eigen::AlignedBox2d& square);

  // Height: the mean of all passes near p, weighed by 1 / (distance^2 + 3 m^2)^2 and faded out
  // towards CityPath::kReach_m. Exact within the square; beyond, passes may be missing.
  GroundPoint At(const Eigen::Vector2d& p) const;

  // The square's surface, triangles of 1 m cut along the street's edges; the curb's face stands
  // upright. `square` has whole metres. Vertices are relative to `origin`.
  void AddMesh(const Eigen::Vector3d& origin, MeshBuilder& out) const;

 private:
  const CityPath& path_;
  Eigen::AlignedBox2d square_;
  std::vector<std::uint32_t> near_;
};

}  // namespace atlas
