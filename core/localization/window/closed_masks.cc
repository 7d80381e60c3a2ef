#include "core/localization/window/closed_masks.h"

#include <algorithm>

#include "core/localization/window/occupied_rows.h"

namespace atlas {
namespace {

constexpr std::ptrdiff_t kMaxReach = 4;  // cells to either side of one in a gap
// Structure on the other side of a gap lies no further away.
constexpr std::int32_t kGapMargin = 2 * static_cast<std::int32_t>(kMaxReach);

}  // namespace

std::int32_t ClosedMasks::Border(std::int32_t cells) {
  return std::min(OccupiedRows::kMaxBorder, cells - kGapMargin);
}

std::span<const std::uint64_t> ClosedMasks::Of(const NineContents& nine,
                                               std::int32_t cells,
                                               float cell_size_m) {
  constexpr float kGap_m = 0.25F;
  const std::int32_t border = Border(cells);
  Gather(nine, cells, border + kGapMargin);
  CloseGaps(
      std::clamp(static_cast<std::ptrdiff_t>(kGap_m / cell_size_m), std::ptrdiff_t{1}, kMaxReach));
  // Without the margin, in place: rows move towards the front.
  const std::ptrdiff_t side = cells + 2 * border;
  for (std::ptrdiff_t y = 0; y < side; ++y) {
    const auto from = closed_.begin() + (y + kGapMargin) * side_ + kGapMargin;
    std::copy(from, from + side, closed_.begin() + y * side);
  }
  return std::span(closed_).first(static_cast<std::size_t>(side * side));
}

void ClosedMasks::Gather(const NineContents& nine, std::int32_t cells, std::int32_t margin) {
  side_ = cells + 2 * margin;
  const auto size = static_cast<std::size_t>(side_ * side_);
  occupied_.assign(size, 0);
  free_.assign(size, 0);
  for (std::int32_t n = 0; n < 9; ++n) {
    const PlaceContent* content = nine[static_cast<std::size_t>(n)];
    if (content == nullptr || content->is_empty()) {
      continue;
    }
    // Of its cells those within the margin; (left, low) is its corner among all.
    const std::int32_t left = margin + (n % 3 - 1) * cells;
    const std::int32_t low = margin + (n / 3 - 1) * cells;
    const auto side = static_cast<std::int32_t>(side_);
    const std::int32_t first = std::max(0, -left);
    const std::int32_t end = std::min(cells, side - left);
    for (std::int32_t y = std::max(0, -low); y < std::min(cells, side - low); ++y) {
      const std::ptrdiff_t from = std::ptrdiff_t{y} * cells + first;
      const std::ptrdiff_t to = std::ptrdiff_t{low + y} * side_ + left + first;
      std::copy_n(content->occupied().begin() + from, end - first, occupied_.begin() + to);
      std::copy_n(content->free().begin() + from, end - first, free_.begin() + to);
    }
  }
}

// A cell has one layer for each ground, and what stands on another ground than its own may be left
// out of it: a wall between two ramps has holes. A gap across which structure stands on both sides
// is structure, unless rays crossed it.
void ClosedMasks::CloseGaps(std::ptrdiff_t reach) {
  closed_ = occupied_;
  const auto fill = [&](std::ptrdiff_t cell, std::ptrdiff_t step) {
    for (std::ptrdiff_t length = 2; length <= 2 * reach; ++length) {
      const std::uint64_t both = occupied_[static_cast<std::size_t>(cell)] &
                                 occupied_[static_cast<std::size_t>(cell + length * step)];
      for (std::ptrdiff_t k = std::max<std::ptrdiff_t>(1, length - reach);
           both != 0 && k <= std::min(reach, length - 1); ++k) {
        const auto between = static_cast<std::size_t>(cell + k * step);
        closed_[between] |= both & ~free_[between];
      }
    }
  };
  const std::ptrdiff_t margin = 2 * reach;
  for (std::ptrdiff_t y = 0; y < side_ - margin; ++y) {
    for (std::ptrdiff_t x = margin; x < side_ - margin; ++x) {
      const std::ptrdiff_t cell = y * side_ + x;
      if (occupied_[static_cast<std::size_t>(cell)] == 0) {
        continue;
      }
      for (const std::ptrdiff_t step : {std::ptrdiff_t{1}, side_, side_ + 1, side_ - 1}) {
        fill(cell, step);
      }
    }
  }
}

}  // namespace atlas
