// Which cells of a place and around it are occupied at a height, as rows of bits: what stands near
// a point is found without looking at every cell.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/localization/window/window_grid.h"

namespace atlas {

// Cells are counted from the place's lowest one; those of the border are negative or behind its
// last one.
class OccupiedRows {
 public:
  static constexpr std::int32_t kMaxReach = 31;
  static constexpr std::int32_t kMaxBorder = kMaxReach + 1;

  // A place of `cells` cells a side with a border of 1 to kMaxBorder on all sides. `masks`: of all
  // of these, row-major, bit k of a cell its segment k.
  void Assign(std::int32_t cells, std::int32_t border, std::span<const std::uint64_t> masks);
  void Clear();

  // The occupied cell of `segment` whose centre is nearest to `at` (in cells, within the place),
  // nearer than `radius`; of equals the lowest row's, its first. A radius beyond the border or
  // kMaxReach counts as that.
  std::optional<WindowCell> Nearest(const Eigen::Vector2f& at, int segment, float radius) const;

  // The cells up to `width` before and behind `middle`, a cell of the place, in the row `dy` above
  // it, lowest first; none beyond the border.
  std::uint64_t Around(WindowCell middle, std::int32_t dy, int segment, std::int32_t width) const {
    const std::int32_t y = middle.y + dy;
    const std::uint32_t plane = plane_[static_cast<std::size_t>(segment)];
    if (plane == kNone || y < -border_ || y >= cells_ + border_) {
      return 0;
    }
    return Bits(plane, y, middle.x - width) & ((std::uint64_t{2} << (2 * width)) - 1);
  }
  // Of the place's cell `middle` and the eight around it: a row in three bits, the lowest first.
  unsigned Nine(WindowCell middle, int segment) const {
    const std::uint32_t plane = plane_[static_cast<std::size_t>(segment)];
    if (plane == kNone) {
      return 0;
    }
    unsigned nine = 0;
    for (std::int32_t row = 0; row < 3; ++row) {
      nine |= static_cast<unsigned>(Bits(plane, middle.y - 1 + row, middle.x - 1) & 7U)
              << (3 * row);
    }
    return nine;
  }
  bool IsOccupied(WindowCell cell, int segment) const {
    const std::uint32_t plane = plane_[static_cast<std::size_t>(segment)];
    return plane != kNone && (Bits(plane, cell.y, cell.x) & 1) != 0;
  }

  // Occupied segments of the place, without its border.
  std::uint32_t count() const { return count_; }
  // How many of them come before this one, which is one.
  std::uint32_t Rank(WindowCell cell, int segment) const;

 private:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  std::size_t Row(std::uint32_t plane, std::int32_t y) const {
    return plane + static_cast<std::size_t>(y + border_) * row_words_;
  }
  // 64 bits from `first` on, which may lie kMaxBorder outside.
  std::uint64_t Bits(std::uint32_t plane, std::int32_t y, std::int32_t first) const {
    const auto at = static_cast<std::uint32_t>(first + kMaxBorder);
    const std::uint64_t* word = &words_[Row(plane, y) + at / 64];
    const std::uint32_t shift = at % 64;
    return shift == 0 ? word[0] : (word[0] >> shift) | (word[1] << (64 - shift));
  }
  std::uint32_t CountBefore(std::uint32_t plane, std::int32_t y, std::int32_t end) const;
  void CountRows();

  std::int32_t cells_ = 0;
  std::int32_t border_ = 0;
  std::size_t row_words_ = 0;
  std::array<std::uint32_t, WindowGrid::kSegments> plane_{};  // by segment: its first word
  std::vector<std::uint64_t> words_;                          // of segments with anything, by row
  std::vector<std::uint32_t> before_;  // by such a segment and row: occupied before it
  std::uint32_t count_ = 0;
};

}  // namespace atlas
