#include "client/score/curb_score.h"

#include <cmath>
#include <unordered_map>

namespace atlas {
namespace {

constexpr float kCell_m = 0.1F;
constexpr float kMinRange_m = 2.7F;
constexpr float kMaxRange_m = 80.0F;

enum class Surface { kRoad, kSidewalk, kOtherGround, kIrrelevant };

Surface SurfaceOf(std::uint32_t label) {
  switch (label & 0xFFFFU) {
    case 40:  // road
    case 44:  // parking
    case 60:  // lane marking
      return Surface::kRoad;
    case 48:
      return Surface::kSidewalk;
    case 49:  // other ground
    case 72:  // terrain
      return Surface::kOtherGround;
    default:
      return Surface::kIrrelevant;
  }
}

struct Cell {
  bool has_road = false;
  bool has_sidewalk = false;
  std::uint32_t ground = 0;  // of the judged returns
  std::uint32_t obstacle = 0;
};

using CellMap = std::unordered_map<std::uint64_t, Cell>;

std::uint64_t KeyOf(std::int32_t x, std::int32_t y) {
  return (std::uint64_t{static_cast<std::uint32_t>(x)} << 32) | static_cast<std::uint32_t>(y);
}

std::uint64_t KeyOf(const Eigen::Vector3f& p) {
  return KeyOf(static_cast<std::int32_t>(std::floor(p.x() / kCell_m)),
               static_cast<std::int32_t>(std::floor(p.y() / kCell_m)));
}

bool IsInRange(const Eigen::Vector3f& p) {
  const float range_m = p.norm();
  return range_m >= kMinRange_m && range_m <= kMaxRange_m;
}

// What the cell and its eight neighbours hold.
Cell Around(const CellMap& cells, std::uint64_t key) {
  Cell around;
  const auto x = static_cast<std::int32_t>(key >> 32);
  const auto y = static_cast<std::int32_t>(key & 0xFFFFFFFFU);
  for (int n = 0; n < 9; ++n) {
    const auto found = cells.find(KeyOf(x + n % 3 - 1, y + n / 3 - 1));
    if (found != cells.end()) {
      around.has_road = around.has_road || found->second.has_road;
      around.has_sidewalk = around.has_sidewalk || found->second.has_sidewalk;
    }
  }
  return around;
}

// What the labels and the judgement say of each cell.
CellMap CellsOf(std::span<const Eigen::Vector3f> p_level,
                std::span<const std::uint32_t> labels,
                std::span<const JudgedReturn> judged) {
  CellMap cells;
  for (std::size_t i = 0; i < p_level.size(); ++i) {
    const Surface surface = SurfaceOf(labels[i]);
    const bool is_side = surface == Surface::kRoad || surface == Surface::kSidewalk;
    if (is_side && IsInRange(p_level[i])) {
      Cell& cell = cells[KeyOf(p_level[i])];
      (surface == Surface::kRoad ? cell.has_road : cell.has_sidewalk) = true;
    }
  }
  for (const JudgedReturn& judge : judged) {
    const Eigen::Vector3f& p = p_level[judge.index];
    if (SurfaceOf(labels[judge.index]) != Surface::kIrrelevant && IsInRange(p)) {
      Cell& cell = cells[KeyOf(p)];
      ++(judge.is_called_ground ? cell.ground : cell.obstacle);
    }
  }
  return cells;
}

std::optional<double> Ratio(std::uint64_t part, std::uint64_t whole) {
  if (whole == 0) {
    return std::nullopt;
  }
  return static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

std::optional<double> CurbCounts::missed_curb() const {
  return Ratio(missed_curb_cells, curb_cells);
}

std::optional<double> CurbCounts::false_road() const {
  return Ratio(false_road_cells, road_cells);
}

void CountCurbs(std::span<const Eigen::Vector3f> p_level,
                std::span<const std::uint32_t> labels,
                std::span<const JudgedReturn> judged,
                CurbCounts& counts) {
  const CellMap cells = CellsOf(p_level, labels, judged);
  for (const auto& [key, cell] : cells) {
    const Cell around = Around(cells, key);
    const bool is_curb = around.has_road && around.has_sidewalk;
    if (cell.ground + cell.obstacle == 0 || (!is_curb && !cell.has_road)) {
      continue;
    }
    const bool is_traversable = cell.ground > cell.obstacle;
    if (is_curb) {
      ++counts.curb_cells;
      counts.missed_curb_cells += is_traversable ? 1U : 0U;
    } else {
      ++counts.road_cells;
      counts.false_road_cells += is_traversable ? 0U : 1U;
    }
  }
}

}  // namespace atlas
