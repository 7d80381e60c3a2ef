// Rows of bits, from the nearest row on.
#include "core/planning/surface/obstacle_clearance.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>

namespace atlas {
namespace {

// Surfaces differ in height by no more than this per metre across, be it on the steepest ramp.
constexpr double kSameSurfaceSlope = 0.7;
// An obstacle's altitude is that of the ground near it, known to about this much.
constexpr std::int32_t kHeightSlack_mm = 300;
constexpr double kClearanceSteps = 250.0;
constexpr std::int32_t kWordCells = 64;

}  // namespace

ObstacleClearance::ObstacleClearance(const SurfaceTiles& tiles, const PlanOptions& options)
    : tiles_(tiles),
      reach_m_(options.clearance_reach_m()),
      reach_cells_(static_cast<std::int32_t>(reach_m_ / tiles.cell_m())),
      side_(tiles.side()),
      // A word more, so that 64 cells can be read from any one on.
      row_words_((side_ + 2 * reach_cells_ + kWordCells - 1) / kWordCells + 1) {
  const double reach_cells = reach_m_ / tiles.cell_m();
  none_squared_ = static_cast<std::int32_t>(std::floor(reach_cells * reach_cells + 1e-9)) + 1;
  for (std::int32_t squared = 0; squared < none_squared_; ++squared) {
    const double distance_m = std::sqrt(squared) * tiles.cell_m();
    const double steps = reach_m_ > 0.0 ? kClearanceSteps * distance_m / reach_m_ : 0.0;
    steps_.push_back(static_cast<std::uint8_t>(std::lround(steps)));
    height_limit_mm_.push_back(kHeightSlack_mm + static_cast<std::int32_t>(std::lround(
                                                     1e3 * kSameSurfaceSlope * distance_m)));
  }
}

double ObstacleClearance::Metres(std::uint8_t clearance) const {
  return clearance == SurfaceNode::kFar ? reach_m_ : reach_m_ * clearance / kClearanceSteps;
}

std::uint8_t ObstacleClearance::Of(const NodeRef& ref) {
  const SurfaceNode& node = tiles_.node(ref);
  Search search{tiles_.tile(ref.slot), RowsOf(ref.slot),  node,
                node.cell % side_,     node.cell / side_, none_squared_};
  SearchRow(search, 0);
  for (std::int32_t dy = 1; dy <= reach_cells_ && dy * dy < search.nearest_squared; ++dy) {
    SearchRow(search, -dy);
    SearchRow(search, dy);
  }
  return search.nearest_squared < none_squared_
             ? steps_[static_cast<std::size_t>(search.nearest_squared)]
             : SurfaceNode::kFar;
}

void ObstacleClearance::SearchRow(Search& search, std::int32_t dy) const {
  const std::uint64_t* row =
      &search.rows[static_cast<std::size_t>((search.y + dy + reach_cells_) * row_words_)];
  for (std::int32_t dx = -reach_cells_; dx <= reach_cells_; dx += kWordCells) {
    const std::int32_t first = search.x + dx + reach_cells_;
    const std::int32_t in_word = first % kWordCells;
    const std::uint64_t* word = row + first / kWordCells;
    std::uint64_t bits = word[0] >> in_word;
    if (in_word != 0) {
      bits |= word[1] << (kWordCells - in_word);
    }
    const std::int32_t left = reach_cells_ - dx + 1;
    if (left < kWordCells) {
      bits &= (std::uint64_t{1} << left) - 1;
    }
    for (; bits != 0; bits &= bits - 1) {
      const std::int32_t x = dx + std::countr_zero(bits);
      const std::int32_t squared = x * x + dy * dy;
      if (squared < search.nearest_squared && IsInTheWay(search, x, dy)) {
        search.nearest_squared = squared;
      }
    }
  }
}

const std::vector<std::uint64_t>& ObstacleClearance::RowsOf(std::uint32_t slot) {
  if (rows_.size() <= slot) {
    rows_.resize(tiles_.size());
  }
  Rows& rows = rows_[slot];
  const SurfaceTile& home = tiles_.tile(slot);
  if (rows.added != home.linked) {
    rows.words.resize(static_cast<std::size_t>((side_ + 2 * reach_cells_) * row_words_));
    for (std::size_t i = 0; i < home.around.size(); ++i) {
      if (((home.linked & ~rows.added) >> i & 1) != 0) {
        AddRows(tiles_.tile(static_cast<std::uint32_t>(home.around[i])),
                (static_cast<std::int32_t>(i % 3) - 1) * side_ + reach_cells_,
                (static_cast<std::int32_t>(i / 3) - 1) * side_ + reach_cells_, rows.words);
      }
    }
    rows.added = home.linked;
  }
  return rows.words;
}

// Cell (x, y) of the tile is bit x + shift_x of row y + shift_y, where there is one.
void ObstacleClearance::AddRows(const SurfaceTile& tile,
                                std::int32_t shift_x,
                                std::int32_t shift_y,
                                std::vector<std::uint64_t>& rows) const {
  const std::int32_t width = side_ + 2 * reach_cells_;
  for (std::int32_t y = std::max(0, -shift_y); y < std::min(side_, width - shift_y); ++y) {
    std::uint64_t* row = &rows[static_cast<std::size_t>((y + shift_y) * row_words_)];
    for (std::size_t i = 0; i < tile.row_words(side_); ++i) {
      for (std::uint64_t bits =
               tile.obstacle_bits[static_cast<std::size_t>(y) * tile.row_words(side_) + i];
           bits != 0; bits &= bits - 1) {
        const std::int32_t x =
            static_cast<std::int32_t>(i) * kWordCells + std::countr_zero(bits) + shift_x;
        if (x >= 0 && x < width) {
          row[x / kWordCells] |= std::uint64_t{1} << (x % kWordCells);
        }
      }
    }
  }
}

bool ObstacleClearance::IsInTheWay(const Search& search, std::int32_t dx, std::int32_t dy) const {
  const CellNodes cell = tiles_.Cell(search.home, search.x + dx, search.y + dy);
  const std::int64_t height_mm = search.node.altitude_mm;
  const std::int32_t limit_mm = height_limit_mm_[static_cast<std::size_t>(dx * dx + dy * dy)];
  const SurfaceTile& tile = tiles_.tile(cell.slot);
  for (std::uint32_t i = cell.begin; i < cell.end; ++i) {
    const SurfaceNode& obstacle = tile.nodes[i];
    if (obstacle.Has(SurfaceNode::kObstacle) &&
        std::abs(height_mm - obstacle.altitude_mm) <= limit_mm && ReachesTo(cell, i, height_mm)) {
      return true;
    }
  }
  return false;
}

// An obstacle is in the way no further than half-way to the surfaces above and below it, so that
// what stands under a ramp does not close the ramp.
bool ObstacleClearance::ReachesTo(const CellNodes& cell,
                                  std::uint32_t obstacle,
                                  std::int64_t height_mm) const {
  const SurfaceTile& tile = tiles_.tile(cell.slot);
  const std::int64_t altitude_mm = tile.nodes[obstacle].altitude_mm;
  for (std::uint32_t i = cell.begin; i < cell.end; ++i) {
    const std::int64_t other_mm = tile.nodes[i].altitude_mm;
    const std::int64_t middle_mm = (altitude_mm + other_mm) / 2;
    if ((other_mm > altitude_mm && height_mm > middle_mm) ||
        (other_mm < altitude_mm && height_mm < middle_mm)) {
      return false;
    }
  }
  return true;
}

}  // namespace atlas
