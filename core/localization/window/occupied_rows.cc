#include "core/localization/window/occupied_rows.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace atlas {

OccupiedRows::OccupiedRows(const WindowGrid& grid, std::span<const std::uint64_t> masks) {
  const auto side = static_cast<std::size_t>(grid.side());
  rows_ = grid.side();
  row_words_ = (side + 2 * kPadding + 63) / 64 + 1;
  std::uint64_t any = 0;
  for (const std::uint64_t mask : masks) {
    any |= mask;
  }
  plane_.fill(kNone);
  std::size_t words = 0;
  for (std::uint64_t left = any; left != 0; left &= left - 1) {
    plane_[static_cast<std::size_t>(std::countr_zero(left))] = static_cast<std::uint32_t>(words);
    words += side * row_words_;
  }
  words_.assign(words, 0);
  for (std::size_t y = 0; y < side; ++y) {
    for (std::size_t x = 0; x < side; ++x) {
      const std::size_t bit = x + static_cast<std::size_t>(kPadding);
      for (std::uint64_t mask = masks[y * side + x]; mask != 0; mask &= mask - 1) {
        const std::size_t plane = plane_[static_cast<std::size_t>(std::countr_zero(mask))];
        words_[plane + y * row_words_ + bit / 64] |= std::uint64_t{1} << (bit % 64);
      }
    }
  }
}

std::optional<WindowCell> OccupiedRows::Nearest(const WindowGrid& grid,
                                                const Eigen::Vector2f& p,
                                                int segment,
                                                float radius_m) const {
  const std::uint32_t plane = plane_[static_cast<std::size_t>(segment)];
  if (plane == kNone) {
    return std::nullopt;
  }
  const Eigen::Vector2f place = p / grid.cell_size_m();
  const float radius = radius_m / grid.cell_size_m();
  const WindowCell cell = grid.CellAt(p);
  const auto reach = std::min(static_cast<std::int32_t>(std::ceil(radius)), kMaxReach);
  if (cell.x < -reach || cell.x >= grid.side() + reach) {
    return std::nullopt;
  }
  const std::uint64_t window = (std::uint64_t{2} << (2 * reach)) - 1;
  const std::uint64_t until_cell = (std::uint64_t{2} << reach) - 1;
  std::optional<WindowCell> nearest;
  float best = radius * radius;
  const auto offer = [&](std::int32_t x, std::int32_t y) {
    const float dx = static_cast<float>(x) + 0.5F - place.x();
    const float dy = static_cast<float>(y) + 0.5F - place.y();
    const float distance = dx * dx + dy * dy;
    if (distance < best) {
      best = distance;
      nearest = WindowCell{x, y};
    }
  };
  const std::int32_t first_row = std::max(0, cell.y - reach);
  const std::int32_t last_row = std::min(grid.side() - 1, cell.y + reach);
  const std::int32_t first = cell.x - reach;
  for (std::int32_t y = first_row; y <= last_row; ++y) {
    const float dy = static_cast<float>(y) + 0.5F - place.y();
    if (dy * dy >= best) {
      continue;
    }
    const std::uint64_t bits =
        Bits(plane + static_cast<std::size_t>(y) * row_words_, first) & window;
    // The nearest before or in the point's own column, and the nearest behind it.
    if (const std::uint64_t before = bits & until_cell; before != 0) {
      offer(first + 63 - std::countl_zero(before), y);
    }
    if (const std::uint64_t behind = bits & ~until_cell; behind != 0) {
      offer(first + std::countr_zero(behind), y);
    }
  }
  return nearest;
}

}  // namespace atlas
