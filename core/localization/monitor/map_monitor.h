// Where a vehicle's scans contradict the map while it is localized: what appeared, what vanished,
// what moves (the paper's "detecting dynamic objects given the map", section VI). Only what the map
// measured can be contradicted; of what it does not know nothing is said.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "core/base/status.h"
#include "core/geometry/map_profile.h"
#include "core/geometry/pose.h"
#include "core/geometry/vehicle_body.h"
#include "core/localization/monitor/contradiction.h"
#include "core/localization/monitor/segment_evidence.h"
#include "core/localization/monitor/sight_lines.h"
#include "core/localization/monitor/watched_tile.h"
#include "core/localization/registration/pose_prior.h"
#include "core/localization/window/local_map.h"
#include "core/scan/leveled_scan.h"
#include "core/tile/tile.h"

namespace atlas {

struct MonitorOptions {
  SightOptions sight;
  WatchOptions watch;
  EvidenceOptions evidence;

  double max_sigma_m =
      0.15;  // of the least certain horizontal direction; else a scan is no witness
  double max_sigma_rad = 0.01;  // of the heading
  double margin_m = 12.0;       // tiles are kept so far beyond what is seen
  // A return belongs to structure of the map that is so near and up to half a segment above or
  // below it: a segment is free while something reaches into half of it (decision 0104).
  double structure_reach_m = 0.15;
  // So near to structure, what returns there may be more of it.
  double beside_reach_m = 0.4;
  double foot_m = 0.1;  // lower above the profile's base offset a return may be one of the ground
  double trail_step_m = 0.5;  // places of the vehicle that are remembered ...
  std::size_t max_trail = 400;
};

// For one thread at a time. Memory is that of the tiles around the vehicle.
class MapMonitor {
 public:
  // `tiles`: as the localizer's; of level 0 are looked at, as soon as they are there.
  // Contradictions of a tile are handed out when it has fallen behind; when it comes near again, it
  // begins anew.
  MapMonitor(const MapProfile& profile,
             TilesAround tiles,
             const MonitorOptions& options,
             OnContradiction on_contradiction);

  // A scan that was localized, neither lost nor guessed; one whose covariance is too wide is passed
  // over. `scan`: its number, ascending. Errors are those of the tiles' source; nothing is counted
  // then.
  Status Observe(const LeveledScan& leveled,
                 const Pose& T_world_level,
                 const PoseCovariance& covariance,
                 std::uint32_t scan);
  // Hands out what is still held.
  void Finish();

  std::uint64_t scans() const { return scans_; }  // that were witnesses

 private:
  struct CellPlace {
    WatchedTile* tile = nullptr;
    std::size_t cell = 0;
  };

  Status Renew(const Eigen::Vector3d& center);
  bool IsNear(const TileId& id, const Eigen::Vector3d& center) const;
  void Arrange();
  std::optional<CellPlace> Find(std::int64_t cell_x, std::int64_t cell_y) const;
  void AddReturn(const Eigen::Vector3d& p_world, std::uint32_t scan);
  // Whether the map has structure within `reach_m` of a place, in plan, at heights from `low_m` to
  // `high_m`.
  bool IsNearStructure(const Eigen::Vector2d& p_world,
                       double reach_m,
                       double low_m,
                       double high_m) const;
  bool IsOccupied(std::int64_t cell_x, std::int64_t cell_y, double low_m, double high_m) const;
  void Report(const WatchedTile& tile) const;
  void Drive(const Eigen::Vector3d& place);
  PlaceContext ContextOf(const Eigen::Vector3d& p_world) const;
  bool IsDriven(const Eigen::Vector3d& p_world) const;

  MapProfile profile_;
  TilesAround tiles_;
  MonitorOptions options_;
  OnContradiction on_contradiction_;
  SightLines sight_;
  std::vector<std::unique_ptr<WatchedTile>> watched_;  // by TileId
  // The same by place: a square of tiles from (first_x_, first_y_) on, null where there is none.
  std::vector<WatchedTile*> grid_;
  std::int64_t first_x_ = 0;
  std::int64_t first_y_ = 0;
  std::int64_t width_ = 0;
  std::optional<Eigen::Vector3d> center_;
  std::deque<Eigen::Vector3d> trail_;  // places of the sensor
  std::uint64_t scans_ = 0;
};

}  // namespace atlas
