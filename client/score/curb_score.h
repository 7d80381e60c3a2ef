// How well kerbs are told from the road beside them (paper IV-A), in cells of 0.1 m. There is no
// curb class in SemanticKITTI's labels: a kerb is where road and sidewalk meet.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace atlas {

// Over all scans.
struct CurbCounts {
  std::uint64_t curb_cells = 0;
  std::uint64_t missed_curb_cells = 0;  // called traversable
  std::uint64_t road_cells = 0;
  std::uint64_t false_road_cells = 0;  // called obstacle

  // Shares; none of no cells.
  std::optional<double> missed_curb() const;
  std::optional<double> false_road() const;
};

// A return that the segmenter judged.
struct JudgedReturn {
  std::uint32_t index = 0;  // in the scan
  bool is_called_ground = false;
};

// Adds one scan, gravity-levelled. A kerb cell has points of road or parking and points of sidewalk
// in it or its eight neighbours, all of the scan's returns considered; a road cell has road or
// parking and no sidewalk there. Of the judged returns in a cell those on ground classes count: it
// is called traversable when more than half of them are; cells without one are left out, and so are
// returns outside of 2.7 to 80 m.
void CountCurbs(std::span<const Eigen::Vector3f> p_level,
                std::span<const std::uint32_t> labels,
                std::span<const JudgedReturn> judged,
                CurbCounts& counts);

}  // namespace atlas
