// Contradictions reported against changes made: who saw what, and what was said of it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/geometry/map_profile.h"
#include "core/localization/monitor/contradiction.h"
#include "tests/bench/monitoring/changed_segments.h"

namespace atlas::testing {

// Which changed cells rays passed through or ended in, above their ground, scan by scan: by
// marching along each ray, without anything of the monitor.
class ChangesSeen {
 public:
  // Rays count from `min_range_m` to `max_range_m` from the sensor, in plan.
  ChangesSeen(const ChangedSegments& changes,
              const MapProfile& profile,
              double min_range_m,
              double max_range_m);

  // A scan's returns, world frame, from where it truly was.
  void Add(const Eigen::Vector3d& sensor, std::span<const Eigen::Vector3d> returns);

  // Scans that saw a segment of the cell that was changed so (appeared, vanished).
  std::uint32_t scans(std::size_t cell, ContradictionKind kind) const {
    return seen_[2 * cell + static_cast<std::size_t>(kind)].scans;
  }

 private:
  void March(const Eigen::Vector3d& sensor, const Eigen::Vector3d& end);

  const ChangedSegments& changes_;
  MapProfile profile_;
  double min_range_m_;
  double max_range_m_;
  struct Seen {
    std::uint32_t scans = 0;
    std::uint32_t last = 0;  // of them, from 1
  };
  std::vector<Seen> seen_;  // by cell and kind
  std::uint32_t scan_ = 0;
  // Of a square of cells that holds all changes: index into them plus one, 0 where there is none.
  std::vector<std::uint32_t> grid_;
  std::int64_t first_x_ = 0;
  std::int64_t first_y_ = 0;
  std::int64_t width_ = 0;
  std::int64_t height_ = 0;
};

struct Found {
  std::size_t cells = 0;  // changed, seen in enough scans
  std::size_t found = 0;  // of them, reported: in the cell or one beside it
};

struct ChangeScore {
  // By kind.
  std::array<std::size_t, 3> reported{};
  std::array<std::size_t, 3> right{};  // of the same kind within one cell of a change
  // By kind (appeared, vanished) and part.
  std::array<std::array<Found, kChangePartNames.size()>, 2> recall{};
  Found exact;  // reported in the very cell, all kinds and parts
};

// `min_scans`: that have to have seen a cell for it to count. Of a cell reported twice each counts.
ChangeScore ScoreChanges(std::span<const Contradiction> reported,
                         const ChangedSegments& changes,
                         const ChangesSeen& seen,
                         std::uint32_t min_scans,
                         const MapProfile& profile);

}  // namespace atlas::testing
