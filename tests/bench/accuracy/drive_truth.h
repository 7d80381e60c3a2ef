// What a simulated drive's map should hold, from noise-free rays against the world: surfaces seen,
// structure seen, and cells that moving cars were seen in.
#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "core/simulation/simulated_drive.h"
#include "tests/bench/accuracy/map_cell.h"

namespace atlas::testing {

struct TruthOptions {
  double cell_m = 0.1;
  double range_m = 20.0;  // in plan, as the keyframes'
  std::size_t begin = 0;  // half-open range of scans
  std::size_t end = SIZE_MAX;
  std::uint32_t min_beams = 3;   // over the whole drive
  double step_reach_m = 0.3;     // no counted surface lies nearer to a step
  double step_m = 0.05;          // beyond what the slope explains
  double other_surface_m = 1.0;  // hits further apart in height are of two surfaces
  double structure_low_m = 0.5;  // above ground
  double moving_low_m = 0.3;
  double high_m = 2.0;
};

struct SurfaceTruth {
  double hit_z_m = 0.0;  // of one hit
  std::uint32_t beams = 0;
  bool is_counted = false;  // seen often enough, away from steps
  double altitude_m = 0.0;  // at the cell's centre, where counted
  bool is_free = false;     // nothing static above it up to 2 m
};

struct StructureTruth {
  double ground_m = 0.0;
  std::uint32_t hits = 0;  // 0.5 to 2 m above the ground
  std::size_t first_scan = 0;
  bool is_seen_twice = false;  // by two scans

  bool is_counted(std::uint32_t min_hits) const { return hits >= min_hits && is_seen_twice; }
};

struct CellTruth {
  std::vector<SurfaceTruth> surfaces;
  std::vector<StructureTruth> structures;
  std::vector<double> moving_ground_m;  // ground below returns of moving cars
  std::vector<double> ground_m;         // all ground of the world at the centre, seen or not
  bool has_low_obstacle = false;        // any static hit above ground up to 2 m
};

using TruthMap = std::unordered_map<MapCell, CellTruth, MapCellHash>;

TruthMap MeasureTruth(const SimulatedDrive& drive,
                      const LidarSensor& sensor,
                      const TruthOptions& options);

}  // namespace atlas::testing
