#include "tests/bench/accuracy/drive_truth.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/scan/ego_box.h"
#include "core/simulation/truth_label.h"

namespace atlas::testing {
namespace {

struct GroundHit {
  double z_m = 0.0;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
};

// The first ground straight below (x, y, from_m), at most `down_m` below, through anything else.
std::optional<GroundHit> GroundBelow(const WorldParts& parts,
                                     const Eigen::Vector2d& p,
                                     double from_m,
                                     double down_m) {
  double z_m = from_m;
  while (z_m > from_m - down_m) {
    const WorldHit hit = CastWorld(parts, {p.x(), p.y(), z_m}, -Eigen::Vector3f::UnitZ(),
                                   static_cast<float>(z_m - from_m + down_m));
    if (!hit.is_hit()) {
      return std::nullopt;
    }
    z_m -= static_cast<double>(hit.hit.distance_m);
    if (IsGroundLabel(hit.label())) {
      const TriangleEdges edges = EdgesOf(hit.part->mesh, hit.hit.triangle);
      Eigen::Vector3d normal = edges.edge1.cross(edges.edge2).cast<double>().normalized();
      normal = normal.z() < 0.0 ? Eigen::Vector3d(-normal) : normal;
      return GroundHit{z_m, normal};
    }
    z_m -= 1e-3;
  }
  return std::nullopt;
}

class TruthMeter {
 public:
  TruthMeter(const SimulatedDrive& drive, const LidarSensor& sensor, const TruthOptions& options)
      : drive_(drive), options_(options), caster_(Exact(sensor)) {}

  TruthMap Run() {
    const std::size_t end = std::min(options_.end, drive_.scans());
    for (std::size_t i = options_.begin; i < end; ++i) {
      AddScan(i);
    }
    for (auto& [cell, truth] : map_) {
      for (SurfaceTruth& surface : truth.surfaces) {
        Judge(cell, truth, surface);
      }
      if (!truth.surfaces.empty()) {
        Plumb(cell, truth);
      }
    }
    return std::move(map_);
  }

 private:
  static ScanCaster Exact(LidarSensor sensor) {
    sensor.range_sigma_m = 0.0;
    return ScanCaster(std::move(sensor));
  }

  void AddScan(std::size_t i) {
    parts_ = drive_.still_world().Around(drive_.sensor_pose(i).translation(), 60.0);
    const auto for_each = [&](const SimulatedScan& scan, const auto& use) {
      for (std::size_t k = 0; k < scan.points.size(); ++k) {
        const Eigen::Vector3d p(scan.points[k].x, scan.points[k].y, scan.points[k].z);
        if (EgoBox().Contains(p.cast<float>())) {
          continue;
        }
        const Eigen::Vector3d p_world = drive_.sensor_pose(i) * p;
        const Eigen::Vector3d ray = p_world - drive_.sensor_pose(i).translation();
        if (ray.head<2>().norm() < options_.range_m) {
          use(p_world, ray, scan.labels[k]);
        }
      }
    };
    for_each(drive_.StillScan(i, caster_), [&](const auto& p, const auto& ray, auto label) {
      IsGroundLabel(label) ? AddGround(p, ray) : AddStructure(i, p, ray);
    });
    for_each(drive_.Scan(i), [&](const auto& p, const auto& ray, auto label) {
      if (ClassOfLabel(label) == TruthClass::kMovingCar) {
        AddMoving(p, ray);
      }
    });
  }

  CellTruth& CellOf(const Eigen::Vector3d& p) { return map_[MapCell::At(p, options_.cell_m)]; }

  void AddGround(const Eigen::Vector3d& p, const Eigen::Vector3d& ray) {
    if (ray.z() >= 0.0) {
      return;  // a floor's underside
    }
    std::vector<SurfaceTruth>& surfaces = CellOf(p).surfaces;
    const auto same = std::find_if(surfaces.begin(), surfaces.end(), [&](const auto& surface) {
      return std::abs(surface.hit_z_m - p.z()) < options_.other_surface_m;
    });
    if (same == surfaces.end()) {
      surfaces.push_back({p.z(), 1, false, 0.0, false});
    } else {
      ++same->beams;
    }
  }

  // Ground below a return, looked for 5 cm in front of it: a wall need not stand on any.
  std::optional<double> GroundOf(const Eigen::Vector3d& p, const Eigen::Vector3d& ray) const {
    const Eigen::Vector2d front = p.head<2>() - 0.05 * ray.head<2>().normalized();
    const auto ground = GroundBelow(parts_, front, p.z() + 0.02, options_.high_m + 0.1);
    return ground ? std::optional(ground->z_m) : std::nullopt;
  }

  void AddStructure(std::size_t scan, const Eigen::Vector3d& p, const Eigen::Vector3d& ray) {
    const std::optional<double> ground_m = GroundOf(p, ray);
    if (!ground_m || p.z() - *ground_m > options_.high_m) {
      return;
    }
    CellTruth& cell = CellOf(p);
    cell.has_low_obstacle = true;
    if (p.z() - *ground_m < options_.structure_low_m) {
      return;
    }
    const auto same = std::find_if(
        cell.structures.begin(), cell.structures.end(), [&](const StructureTruth& structure) {
          return std::abs(structure.ground_m - *ground_m) < options_.other_surface_m;
        });
    if (same == cell.structures.end()) {
      cell.structures.push_back({*ground_m, 1, scan, false});
    } else {
      ++same->hits;
      same->is_seen_twice = same->is_seen_twice || same->first_scan != scan;
    }
  }

  void AddMoving(const Eigen::Vector3d& p, const Eigen::Vector3d& ray) {
    const std::optional<double> ground_m = GroundOf(p, ray);
    const double up_m = ground_m ? p.z() - *ground_m : -1.0;
    if (up_m < options_.moving_low_m || up_m > options_.high_m) {
      return;
    }
    std::vector<double>& grounds = CellOf(p).moving_ground_m;
    const bool is_known = std::any_of(grounds.begin(), grounds.end(), [&](double ground) {
      return std::abs(ground - *ground_m) < options_.other_surface_m;
    });
    if (!is_known) {
      grounds.push_back(*ground_m);
    }
  }

  void Judge(const MapCell& cell, const CellTruth& truth, SurfaceTruth& surface) {
    if (surface.beams < options_.min_beams) {
      return;
    }
    const Eigen::Vector2d centre = cell.Centre(options_.cell_m);
    parts_ = drive_.still_world().Around({centre.x(), centre.y(), surface.hit_z_m}, 1.0);
    const auto ground = GroundBelow(parts_, centre, surface.hit_z_m + 0.3, 0.6);
    if (!ground || IsNearStep(centre, *ground)) {
      return;
    }
    surface.is_counted = true;
    surface.altitude_m = ground->z_m;
    const WorldHit above = CastWorld(parts_, {centre.x(), centre.y(), ground->z_m + 0.02},
                                     Eigen::Vector3f::UnitZ(), static_cast<float>(options_.high_m));
    surface.is_free = !above.is_hit() && !truth.has_low_obstacle;
  }

  // Every ground above and below what was hit, within 100 m.
  void Plumb(const MapCell& cell, CellTruth& truth) {
    const Eigen::Vector2d centre = cell.Centre(options_.cell_m);
    const double middle_m = truth.surfaces.front().hit_z_m;
    parts_ = drive_.still_world().Around({centre.x(), centre.y(), middle_m}, 1.0);
    double from_m = middle_m + 50.0;
    while (const auto ground = GroundBelow(parts_, centre, from_m, from_m - middle_m + 50.0)) {
      truth.ground_m.push_back(ground->z_m);
      from_m = ground->z_m - 0.01;
    }
  }

  bool IsNearStep(const Eigen::Vector2d& centre, const GroundHit& ground) const {
    const int reach = static_cast<int>(std::floor(options_.step_reach_m / options_.cell_m + 1e-9));
    for (int dy = -reach; dy <= reach; ++dy) {
      for (int dx = -reach; dx <= reach; ++dx) {
        if (dx * dx + dy * dy > reach * reach) {
          continue;
        }
        const Eigen::Vector2d d = options_.cell_m * Eigen::Vector2d(dx, dy);
        const double expected_m = ground.z_m - d.dot(ground.normal.head<2>()) / ground.normal.z();
        const auto there = GroundBelow(parts_, centre + d, expected_m + 0.5, 1.0);
        if (there && std::abs(there->z_m - expected_m) > options_.step_m) {
          return true;
        }
      }
    }
    return false;
  }

  const SimulatedDrive& drive_;
  const TruthOptions& options_;
  ScanCaster caster_;
  WorldParts parts_;
  TruthMap map_;
};

}  // namespace

TruthMap MeasureTruth(const SimulatedDrive& drive,
                      const LidarSensor& sensor,
                      const TruthOptions& options) {
  return TruthMeter(drive, sensor, options).Run();
}

}  // namespace atlas::testing
