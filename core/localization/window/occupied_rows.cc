#include "core/localization/window/occupied_rows.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/base/fast_floor.h"

namespace atlas {

void OccupiedRows::Clear() {
  plane_.fill(kNone);
  words_.clear();
  before_.clear();
  count_ = 0;
}

void OccupiedRows::Assign(std::int32_t cells,
                          std::int32_t border,
                          std::span<const std::uint64_t> masks) {
  Clear();
  cells_ = cells;
  border_ = border;
  row_words_ = static_cast<std::size_t>(cells + 2 * kMaxBorder + 63) / 64 + 1;
  const auto side = static_cast<std::size_t>(cells + 2 * border);
  std::uint64_t any = 0;
  for (const std::uint64_t mask : masks) {
    any |= mask;
  }
  std::size_t words = 0;
  for (; any != 0; any &= any - 1) {
    plane_[static_cast<std::size_t>(std::countr_zero(any))] = static_cast<std::uint32_t>(words);
    words += side * row_words_;
  }
  words_.assign(words, 0);
  for (std::size_t y = 0; y < side; ++y) {
    for (std::size_t x = 0; x < side; ++x) {
      const std::size_t bit = x + static_cast<std::size_t>(kMaxBorder - border);
      for (std::uint64_t mask = masks[y * side + x]; mask != 0; mask &= mask - 1) {
        const std::size_t plane = plane_[static_cast<std::size_t>(std::countr_zero(mask))];
        words_[plane + y * row_words_ + bit / 64] |= std::uint64_t{1} << (bit % 64);
      }
    }
  }
  CountRows();
}

void OccupiedRows::CountRows() {
  for (const std::uint32_t plane : plane_) {
    for (std::int32_t y = 0; plane != kNone && y < cells_; ++y) {
      before_.push_back(count_);
      count_ += CountBefore(plane, y, cells_);
    }
  }
}

std::uint32_t OccupiedRows::CountBefore(std::uint32_t plane,
                                        std::int32_t y,
                                        std::int32_t end) const {
  std::uint32_t count = 0;
  for (std::int32_t first = 0; first < end; first += 64) {
    const std::int32_t left = end - first;
    const std::uint64_t wanted = left < 64 ? (std::uint64_t{1} << left) - 1 : ~std::uint64_t{0};
    count += static_cast<std::uint32_t>(std::popcount(Bits(plane, y, first) & wanted));
  }
  return count;
}

std::uint32_t OccupiedRows::Rank(WindowCell cell, int segment) const {
  const std::uint32_t plane = plane_[static_cast<std::size_t>(segment)];
  const std::size_t nth = plane / (static_cast<std::size_t>(cells_ + 2 * border_) * row_words_);
  return before_[nth * static_cast<std::size_t>(cells_) + static_cast<std::size_t>(cell.y)] +
         CountBefore(plane, cell.y, cell.x);
}

std::optional<WindowCell> OccupiedRows::Nearest(const Eigen::Vector2f& at,
                                                int segment,
                                                float radius) const {
  const std::uint32_t plane = plane_[static_cast<std::size_t>(segment)];
  if (plane == kNone) {
    return std::nullopt;
  }
  const WindowCell cell{FastFloor(at.x()), FastFloor(at.y())};
  const std::int32_t reach =
      std::min({static_cast<std::int32_t>(std::ceil(radius)), kMaxReach, border_});
  const std::uint64_t window = (std::uint64_t{2} << (2 * reach)) - 1;
  const std::uint64_t until_cell = (std::uint64_t{2} << reach) - 1;
  std::optional<WindowCell> nearest;
  float best = radius * radius;
  const auto offer = [&](std::int32_t x, std::int32_t y) {
    const float dx = static_cast<float>(x) + 0.5F - at.x();
    const float dy = static_cast<float>(y) + 0.5F - at.y();
    const float distance = dx * dx + dy * dy;
    if (distance < best) {
      best = distance;
      nearest = WindowCell{x, y};
    }
  };
  const std::int32_t first = cell.x - reach;
  for (std::int32_t y = cell.y - reach; y <= cell.y + reach; ++y) {
    const float dy = static_cast<float>(y) + 0.5F - at.y();
    if (dy * dy >= best || y < -border_ || y >= cells_ + border_) {
      continue;
    }
    const std::uint64_t bits = Bits(plane, y, first) & window;
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
