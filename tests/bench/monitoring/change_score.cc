#include "tests/bench/monitoring/change_score.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

namespace atlas::testing {
namespace {

// What was reported of a kind, by cell: bits as of ChangedSegments.
class ReportedCells {
 public:
  ReportedCells(std::span<const Contradiction> reported,
                ContradictionKind kind,
                const ChangedSegments& changes,
                std::int64_t segment_mm) {
    for (const Contradiction& c : reported) {
      if (c.kind == kind) {
        bits_[Key(c.cell_x, c.cell_y)] |= changes.Between(c.low_mm, c.high_mm, segment_mm);
      }
    }
  }

  bool Has(std::int64_t x, std::int64_t y, std::uint64_t bits, std::int64_t reach) const {
    for (std::int64_t dy = -reach; dy <= reach; ++dy) {
      for (std::int64_t dx = -reach; dx <= reach; ++dx) {
        const auto at = bits_.find(Key(x + dx, y + dy));
        if (at != bits_.end() && (at->second & bits) != 0) return true;
      }
    }
    return false;
  }

 private:
  static std::uint64_t Key(std::int64_t x, std::int64_t y) {
    return (static_cast<std::uint64_t>(x) << 32) ^ static_cast<std::uint32_t>(y);
  }
  std::unordered_map<std::uint64_t, std::uint64_t> bits_;
};

// What moves where the map was made free did appear.
bool IsRight(const Contradiction& c, const ChangedSegments& changes, std::int64_t segment_mm) {
  const std::uint64_t bits = changes.Between(c.low_mm, c.high_mm, segment_mm);
  for (std::int64_t dy = -1; dy <= 1; ++dy) {
    for (std::int64_t dx = -1; dx <= 1; ++dx) {
      const ChangedCell* cell = changes.At(c.cell_x + dx, c.cell_y + dy);
      if (cell != nullptr && (cell->Of(c.kind) & bits) != 0) return true;
    }
  }
  return false;
}

// The last step ends where the ray does.
double Next(double at_m, double step_m, double last_m) {
  return at_m < last_m ? std::min(at_m + step_m, last_m) : 2.0 * last_m + step_m;
}

}  // namespace

ChangesSeen::ChangesSeen(const ChangedSegments& changes,
                         const MapProfile& profile,
                         double min_range_m,
                         double max_range_m)
    : changes_(changes),
      profile_(profile),
      min_range_m_(min_range_m),
      max_range_m_(max_range_m),
      seen_(2 * changes.cells.size()) {
  if (changes.cells.empty()) return;
  std::int64_t last_x = std::numeric_limits<std::int64_t>::min();
  std::int64_t last_y = last_x;
  first_x_ = first_y_ = std::numeric_limits<std::int64_t>::max();
  for (const ChangedCell& cell : changes.cells) {
    first_x_ = std::min(first_x_, cell.x);
    first_y_ = std::min(first_y_, cell.y);
    last_x = std::max(last_x, cell.x);
    last_y = std::max(last_y, cell.y);
  }
  width_ = last_x - first_x_ + 1;
  height_ = last_y - first_y_ + 1;
  grid_.assign(static_cast<std::size_t>(width_ * height_), 0);
  for (std::size_t i = 0; i < changes.cells.size(); ++i) {
    const ChangedCell& cell = changes.cells[i];
    grid_[static_cast<std::size_t>((cell.y - first_y_) * width_ + cell.x - first_x_)] =
        static_cast<std::uint32_t>(i + 1);
  }
}

void ChangesSeen::Add(const Eigen::Vector3d& sensor, std::span<const Eigen::Vector3d> returns) {
  ++scan_;
  for (const Eigen::Vector3d& end : returns) March(sensor, end);
}

void ChangesSeen::March(const Eigen::Vector3d& sensor, const Eigen::Vector3d& end) {
  const Eigen::Vector3d ray = end - sensor;
  const double length_m = ray.head<2>().norm();
  const double cell_m = profile_.cell_size_m();
  const double step_m = 0.5 * cell_m;
  const double last_m = std::min(length_m, max_range_m_);
  for (double at_m = min_range_m_; at_m <= last_m; at_m = Next(at_m, step_m, last_m)) {
    const Eigen::Vector3d p = sensor + at_m / length_m * ray;
    const std::int64_t x = static_cast<std::int64_t>(std::floor(p.x() / cell_m)) - first_x_;
    const std::int64_t y = static_cast<std::int64_t>(std::floor(p.y() / cell_m)) - first_y_;
    if (x < 0 || y < 0 || x >= width_ || y >= height_) continue;
    const std::uint32_t index = grid_[static_cast<std::size_t>(y * width_ + x)];
    if (index == 0) continue;
    const ChangedCell& cell = changes_.cells[index - 1];
    if (p.z() < cell.foot_m) continue;
    const int bit =
        static_cast<int>(std::floor(p.z() / profile_.segment_height_m())) - changes_.lowest;
    if (bit < 0 || bit >= 64) continue;
    for (const auto kind : {ContradictionKind::kAppeared, ContradictionKind::kVanished}) {
      Seen& seen = seen_[2 * (index - 1) + static_cast<std::size_t>(kind)];
      const bool is_seen = (kind == ContradictionKind::kAppeared) == (at_m == length_m);
      if (is_seen && ((cell.Of(kind) >> bit) & 1) != 0 && seen.last != scan_) {
        seen.last = scan_;
        ++seen.scans;
      }
    }
  }
}

ChangeScore ScoreChanges(std::span<const Contradiction> reported,
                         const ChangedSegments& changes,
                         const ChangesSeen& seen,
                         std::uint32_t min_scans,
                         const MapProfile& profile) {
  ChangeScore score;
  for (const Contradiction& c : reported) {
    const auto kind = static_cast<std::size_t>(c.kind);
    ++score.reported[kind];
    if (IsRight(c, changes, profile.segment_height_mm)) ++score.right[kind];
  }
  for (const ContradictionKind kind :
       {ContradictionKind::kAppeared, ContradictionKind::kVanished}) {
    const ReportedCells cells(reported, kind, changes, profile.segment_height_mm);
    for (std::size_t i = 0; i < changes.cells.size(); ++i) {
      const ChangedCell& cell = changes.cells[i];
      if (cell.Of(kind) == 0 || seen.scans(i, kind) < min_scans) continue;
      Found& found =
          score.recall[static_cast<std::size_t>(kind)][static_cast<std::size_t>(cell.part)];
      ++found.cells;
      if (cells.Has(cell.x, cell.y, cell.Of(kind), 1)) ++found.found;
      ++score.exact.cells;
      if (cells.Has(cell.x, cell.y, cell.Of(kind), 0)) ++score.exact.found;
    }
  }
  return score;
}

}  // namespace atlas::testing
