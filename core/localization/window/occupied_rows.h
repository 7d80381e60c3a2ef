// Which cells of a window are occupied at a height, as rows of bits: what stands near a place is
// found without looking at every cell.
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

class OccupiedRows {
 public:
  // `masks`: by cell (WindowGrid::Index), bit k its segment k.
  OccupiedRows(const WindowGrid& grid, std::span<const std::uint64_t> masks);

  // The occupied cell of `segment` whose centre is nearest to `p` (window frame, metres), nearer
  // than `radius_m`; of equals the lowest row's, its first. A radius beyond
  // kMaxReach cells counts as that.
  std::optional<WindowCell> Nearest(const WindowGrid& grid,
                                    const Eigen::Vector2f& p,
                                    int segment,
                                    float radius_m) const;

  // The cells up to `width` before and behind `middle` in its row, lowest first; a row outside the
  // window has none. `middle.x` must be in the window.
  std::uint64_t Around(WindowCell middle, int segment, std::int32_t width) const {
    const std::uint32_t plane = plane_[static_cast<std::size_t>(segment)];
    if (plane == kNone || middle.y < 0 || middle.y >= rows_) {
      return 0;
    }
    return Bits(plane + static_cast<std::size_t>(middle.y) * row_words_, middle.x - width) &
           ((std::uint64_t{2} << (2 * width)) - 1);
  }
  // Whether `first`, which must be in the window, and the two cells behind it are occupied: bits 0
  // to 2.
  unsigned Three(WindowCell first, int segment) const {
    const std::uint32_t plane = plane_[static_cast<std::size_t>(segment)];
    return plane == kNone
               ? 0U
               : static_cast<unsigned>(
                     Bits(plane + static_cast<std::size_t>(first.y) * row_words_, first.x) & 7U);
  }

  static constexpr std::int32_t kMaxReach = 31;

 private:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  // Bits of the cells from `first` on, which may lie kMaxReach + 1 outside the window.
  std::uint64_t Bits(std::size_t row, std::int32_t first) const {
    const auto at = static_cast<std::uint32_t>(first + kPadding);
    const std::uint64_t* word = &words_[row + at / 64];
    const std::uint32_t shift = at % 64;
    return shift == 0 ? word[0] : (word[0] >> shift) | (word[1] << (64 - shift));
  }

  static constexpr std::int32_t kPadding = kMaxReach + 1;  // bits before the first cell

  std::int32_t rows_ = 0;
  std::size_t row_words_ = 0;
  std::array<std::uint32_t, WindowGrid::kSegments> plane_{};  // by segment: its first word
  std::vector<std::uint64_t> words_;                          // of segments with anything, by row
};

}  // namespace atlas
