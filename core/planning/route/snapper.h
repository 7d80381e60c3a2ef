// From a point that somebody names to the surface that a vehicle there stands on.
#pragma once

#include <limits>

#include <Eigen/Core>

#include "core/base/status.h"
#include "core/geometry/map_profile.h"
#include "core/planning/plan_options.h"
#include "core/planning/surface/surface_map.h"

namespace atlas {

class Snapper {
 public:
  // All outlive it.
  Snapper(SurfaceMap& map, const MapProfile& profile, const PlanOptions& options)
      : map_(map), profile_(profile), options_(options) {}

  // The drivable node nearest in plan to `point`, world frame; none where there is a traversable
  // surface, but none that this vehicle may stand on. kNotFound where there is no such surface at
  // all; the message says `what` was looked for. Else as of SurfaceTiles::Load.
  Result<NodeRef> Snap(const char* what, const Eigen::Vector3d& point);

 private:
  struct Best {
    double distance_m = std::numeric_limits<double>::infinity();
    NodeRef ref;
    bool is_anything_open = false;
  };

  Result<Best> Search(const Eigen::Vector3d& point, double below_m);
  Status SearchTile(const TileId& id, const Eigen::Vector3d& point, double below_m, Best& best);
  double DistanceInPlan(const SurfaceTile& tile,
                        std::uint32_t cell,
                        const Eigen::Vector3d& point) const;
  NodeRef Standing(std::uint32_t slot, std::uint32_t cell, double z_m, double below_m) const;

  SurfaceMap& map_;
  const MapProfile& profile_;
  const PlanOptions& options_;
};

}  // namespace atlas
