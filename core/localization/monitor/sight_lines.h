// What a located scan saw of columns of the map: which halves of their segments its rays passed,
// and where it measured something.
#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "core/geometry/pose.h"
#include "core/localization/monitor/scan_sectors.h"
#include "core/localization/monitor/segment_evidence.h"
#include "core/scan/leveled_scan.h"

namespace atlas {

struct SightOptions {
  float min_range_m = 2.0F;   // the vehicle's own roof is nearer
  float max_range_m = 30.0F;  // beyond it rays are too far apart to say much of one cell
  // What is measured so near to a cell may be in it: poses, the map's cells and the motion within a
  // scan blur (decision 0104); with the distance the heading's error counts, too.
  float along_m = 0.25F;
  float along_per_m = 0.005F;
  float beside_m = 0.15F;
  float beside_per_m = 0.003F;
};

// Of a column: its lowest segment's lower half is bit 0.
struct HalvesSeen {
  std::uint32_t passed = 0;   // by rays through the cell, and by all that came near it there
  std::uint32_t hit = 0;      // measured, not ground, within reach of the cell
  std::uint32_t blocked = 0;  // ground within reach, or rays near it that ended before it

  SegmentSight Of(int segment) const {
    const auto halves = [segment](std::uint32_t mask) {
      return static_cast<std::uint8_t>((mask >> (2 * segment)) & 3U);
    };
    const bool is_hit = halves(hit) != 0;
    const int free = halves(passed) & ~halves(blocked);
    return {is_hit, static_cast<std::uint8_t>(is_hit ? 0 : free)};
  }
};

class SightLines {
 public:
  SightLines(const SightOptions& options, float cell_size_m, float segment_height_m);

  // Keeps its memory.
  void Assign(const LeveledScan& scan, const Pose& T_world_level);

  const Pose& T_world_level() const { return T_world_level_; }
  // A column at `offset` (its cell's middle from the sensor, world axes, metres). Nothing where the
  // cell is out of range.
  struct Heights {
    float bottom_m;  // of its lowest segment, above the sensor
    float foot_m;    // likewise; what is below is ground
    int segments;    // up to 16
  };
  HalvesSeen Look(const Eigen::Vector2f& offset, const Heights& heights) const;

 private:
  SightOptions options_;
  float cell_size_m_;
  float halves_per_m_;
  ScanSectors sectors_;
  Pose T_world_level_ = Pose::Identity();
  Eigen::Matrix2f R_level_world_ = Eigen::Matrix2f::Identity();
  Eigen::Vector2f tilt_ =
      Eigen::Vector2f::Zero();  // levelled height per metre in the world's plane
};

}  // namespace atlas
