#include "client/merge/changes/change_cells.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

namespace atlas {
namespace {

// Whether rays passed at `p` (window frame), or a road lies so little below it that nothing stands
// there where one can drive.
bool WasLookedAt(const MapWindow& other, const Eigen::Vector3f& p) {
  constexpr float kDriven_m = 1.6F;
  if (other.IsFree(p)) return true;
  const auto road = other.NearestSurface(p, kDriven_m);
  return road && road->height_m > 0.0F;
}

// Whether `other` was there and found nothing at `p` (world), nor around it.
bool IsBare(const MapWindow& other, const Eigen::Vector3d& p, float step_m, int steps) {
  const Eigen::Vector3f middle = (p - other.origin()).cast<float>();
  if (!WasLookedAt(other, middle)) return false;
  for (int x = -steps; x <= steps; ++x) {
    for (int y = -steps; y <= steps; ++y) {
      for (int z = -1; z <= 1; ++z) {
        const Eigen::Vector3f beside =
            middle + Eigen::Vector3f(static_cast<float>(x) * step_m, static_cast<float>(y) * step_m,
                                     static_cast<float>(z) * other.segment_height_m());
        if (other.IsOccupied(beside)) return false;
      }
    }
  }
  return true;
}

}  // namespace

std::string_view ChangeKindName(ChangeKind kind) {
  return kind == ChangeKind::kAppeared ? "appeared" : "vanished";
}

void AddStandingCells(const MapWindow& standing,
                      const MapWindow& other,
                      const TileId& place,
                      const MapProfile& profile,
                      const ChangeOptions& options,
                      std::vector<StandingCell>& cells) {
  const double cell_m = profile.cell_size_m();
  const double segment_m = profile.segment_height_m();
  const int steps = static_cast<int>(std::ceil(options.reach_m / cell_m));
  standing.ForEachOccupied([&](const Eigen::Vector2f& center, std::uint64_t mask) {
    Eigen::Vector3d p = standing.origin();
    p.head<2>() += center.cast<double>();
    if (std::floor(p.x() / profile.tile_size_m()) != place.x ||
        std::floor(p.y() / profile.tile_size_m()) != place.y) {
      return;
    }
    StandingCell cell{{static_cast<std::int64_t>(std::floor(p.x() / cell_m)),
                       static_cast<std::int64_t>(std::floor(p.y() / cell_m))}};
    for (; mask != 0; mask &= mask - 1) {
      const double low_m = standing.origin().z() + std::countr_zero(mask) * segment_m;
      p.z() = low_m + 0.5 * segment_m;
      if (!IsBare(other, p, static_cast<float>(cell_m), steps)) continue;
      if (cell.segments == 0) cell.low_m = static_cast<float>(low_m);
      cell.high_m = static_cast<float>(low_m + segment_m);
      ++cell.segments;
    }
    if (cell.segments > 0) cells.push_back(cell);
  });
}

namespace {

// Cells by where they are, each in the group of one that stands for it.
class Groups {
 public:
  explicit Groups(const std::vector<StandingCell>& cells) : parent_(cells.size()) {
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
  }

  std::size_t Of(std::size_t i) {
    while (parent_[i] != i) {
      parent_[i] = parent_[parent_[i]];
      i = parent_[i];
    }
    return i;
  }
  // The earlier one stands for both.
  void Join(std::size_t a, std::size_t b) {
    const std::size_t of_a = Of(a);
    const std::size_t of_b = Of(b);
    parent_[std::max(of_a, of_b)] = std::min(of_a, of_b);
  }

 private:
  std::vector<std::size_t> parent_;
};

bool Touch(const StandingCell& a, const StandingCell& b, double reach_cells) {
  const double away = std::hypot(static_cast<double>(a.cell.x - b.cell.x),
                                 static_cast<double>(a.cell.y - b.cell.y));
  return away <= reach_cells && a.low_m <= b.high_m && b.low_m <= a.high_m;
}

void Add(const StandingCell& cell, double cell_size_m, MapChange& change) {
  const Eigen::Vector2d low = cell_size_m * Eigen::Vector2d(static_cast<double>(cell.cell.x),
                                                            static_cast<double>(cell.cell.y));
  const Eigen::Vector2d high = low + Eigen::Vector2d::Constant(cell_size_m);
  const bool is_first = change.cells.empty();
  change.min_m = is_first ? low : change.min_m.cwiseMin(low);
  change.max_m = is_first ? high : change.max_m.cwiseMax(high);
  change.low_m = is_first ? cell.low_m : std::min(change.low_m, double{cell.low_m});
  change.high_m = is_first ? cell.high_m : std::max(change.high_m, double{cell.high_m});
  change.center_m += 0.5 * (low + high);
  change.segments += cell.segments;
  change.cells.push_back(cell.cell);
}

}  // namespace

std::vector<MapChange> GroupCells(std::vector<StandingCell> cells,
                                  ChangeKind kind,
                                  double cell_size_m,
                                  const ChangeOptions& options) {
  const auto place = [](const StandingCell& cell) {
    return std::tie(cell.cell.x, cell.cell.y);
  };
  std::sort(cells.begin(), cells.end(),
            [&](const auto& a, const auto& b) { return place(a) < place(b); });
  const double reach_cells = options.together_m / cell_size_m;
  Groups groups(cells);
  // Sorted by x: of those before a cell only the last few columns are near enough.
  for (std::size_t i = 0, first = 0; i < cells.size(); ++i) {
    while (static_cast<double>(cells[i].cell.x - cells[first].cell.x) > reach_cells) ++first;
    for (std::size_t k = first; k < i; ++k) {
      if (Touch(cells[i], cells[k], reach_cells)) groups.Join(i, k);
    }
  }
  std::map<std::size_t, MapChange> changes;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    Add(cells[i], cell_size_m, changes[groups.Of(i)]);
  }
  std::vector<MapChange> things;
  for (auto& [group, change] : changes) {
    if (change.segments < options.min_segments) continue;
    change.kind = kind;
    change.center_m /= static_cast<double>(change.cells.size());
    things.push_back(std::move(change));
  }
  std::stable_sort(things.begin(), things.end(),
                   [](const MapChange& a, const MapChange& b) { return a.segments > b.segments; });
  return things;
}

}  // namespace atlas
