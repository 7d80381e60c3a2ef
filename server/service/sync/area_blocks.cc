#include "server/service/sync/area_blocks.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "server/store/tile_block.h"

namespace atlas {
namespace {

// Positions are within 1e8 m, where a double holds 1.5e-8 m.
constexpr double kMargin_m = 1e-6;

class BlockSearch {
 public:
  BlockSearch(const SyncArea& area, const BlockRect& rect, PlanWork& work)
      : area_(area),
        rect_(rect),
        work_(work),
        side_m_(area.tile_side_m(rect.level) * kTileBlockSide),
        is_found_(static_cast<std::size_t>(rect.count()), false),
        next_(static_cast<std::size_t>((rect.width + 1) * rect.height)) {
    for (std::size_t i = 0; i < next_.size(); ++i) {
      next_[i] = static_cast<std::int64_t>(i) % (rect.width + 1);
    }
  }

  // Each returns false when that is too much.
  bool Everywhere() {
    for (std::int64_t y = 0; y < rect_.height; ++y) {
      for (std::int64_t x = 0; x < rect_.width; ++x) {
        if (!work_.Take(1) || (area_.Touches(CornerOf(x, y), kTileBlockSideBits) && !Note(x, y))) {
          return false;
        }
      }
    }
    return true;
  }
  bool Beside(const SyncArea::Leg& leg) {
    const double reach_m = area_.reach_m() + kMargin_m;
    const double min_y_m = std::min(leg.from_m.y(), leg.to_m.y()) - reach_m;
    const double max_y_m = std::max(leg.from_m.y(), leg.to_m.y()) + reach_m;
    const std::int64_t last = Place(max_y_m, rect_.min_y, rect_.height);
    for (std::int64_t y = Place(min_y_m, rect_.min_y, rect_.height); y <= last; ++y) {
      if (!work_.Take(1) || !InRow(leg, y)) {
        return false;
      }
    }
    return true;
  }

  std::vector<std::uint64_t> Found() const {
    std::vector<std::uint64_t> blocks;
    for (std::size_t i = 0; i < is_found_.size(); ++i) {
      if (is_found_[i]) {
        const auto at = static_cast<std::int64_t>(i);
        blocks.push_back(TileBlockOf(CornerOf(at % rect_.width, at / rect_.width).Key()));
      }
    }
    std::sort(blocks.begin(), blocks.end());
    return blocks;
  }

 private:
  // Of the leg only what is beside the row is near its blocks: p_m = from_m + t * step_m with
  // min_y_m <= p_m.y <= max_y_m, widened by the reach. Where the row lies beside the whole leg,
  // less of the reach is left along the row.
  bool InRow(const SyncArea::Leg& leg, std::int64_t y) {
    const double reach_m = area_.reach_m() + kMargin_m;
    const double min_y_m = static_cast<double>(rect_.min_y + y) * side_m_;
    const double max_y_m = static_cast<double>(rect_.min_y + y + 1) * side_m_;
    const Eigen::Vector2d step_m = leg.to_m - leg.from_m;
    double enter = 0.0;
    double leave = 1.0;
    if (step_m.y() != 0.0) {
      const double a = (min_y_m - reach_m - leg.from_m.y()) / step_m.y();
      const double b = (max_y_m + reach_m - leg.from_m.y()) / step_m.y();
      enter = std::clamp(std::min(a, b), 0.0, 1.0);
      leave = std::clamp(std::max(a, b), 0.0, 1.0);
    }
    const double a_m = leg.from_m.x() + enter * step_m.x();
    const double b_m = leg.from_m.x() + leave * step_m.x();
    const double beside_m = std::max({min_y_m - std::max(leg.from_m.y(), leg.to_m.y()),
                                      std::min(leg.from_m.y(), leg.to_m.y()) - max_y_m, 0.0});
    const double along_m =
        std::sqrt(std::max(reach_m * reach_m - beside_m * beside_m, 0.0)) + kMargin_m;
    const std::int64_t last = Place(std::max(a_m, b_m) + along_m, rect_.min_x, rect_.width);
    for (std::int64_t x =
             NextLeft(Place(std::min(a_m, b_m) - along_m, rect_.min_x, rect_.width), y);
         x <= last; x = NextLeft(x + 1, y)) {
      if (!work_.Take(1)) {
        return false;
      }
      if (area_.IsWithinReach(leg, CornerOf(x, y), kTileBlockSideBits) && !Note(x, y)) {
        return false;
      }
    }
    return true;
  }

  // The first from `x` on that was not found yet, or the end of the row. Each look halves the way
  // for the next one: legs that lie side by side do not look at the same blocks again.
  std::int64_t NextLeft(std::int64_t x, std::int64_t y) {
    const auto row = static_cast<std::size_t>(y * (rect_.width + 1));
    const auto next = [&](std::int64_t at) -> std::int64_t& {
      return next_[row + static_cast<std::size_t>(at)];
    };
    while (next(x) != x) {
      next(x) = next(next(x));
      x = next(x);
    }
    return x;
  }

  bool Note(std::int64_t x, std::int64_t y) {
    is_found_[IndexOf(x, y)] = true;
    next_[static_cast<std::size_t>(y * (rect_.width + 1) + x)] = x + 1;
    return work_.Take(WorkOfBlock(area_));
  }

  std::int64_t Place(double position_m, std::int64_t first, std::int64_t count) const {
    const double place = std::floor(position_m / side_m_) - static_cast<double>(first);
    return static_cast<std::int64_t>(std::clamp(place, 0.0, static_cast<double>(count - 1)));
  }
  std::size_t IndexOf(std::int64_t x, std::int64_t y) const {
    return static_cast<std::size_t>(y * rect_.width + x);
  }
  TileId CornerOf(std::int64_t x, std::int64_t y) const {
    return {rect_.level, static_cast<std::int32_t>((rect_.min_x + x) * kTileBlockSide),
            static_cast<std::int32_t>((rect_.min_y + y) * kTileBlockSide)};
  }

  const SyncArea& area_;
  const BlockRect& rect_;
  PlanWork& work_;
  const double side_m_;
  std::vector<bool> is_found_;  // row by row
  // By row, and one more at its end: a block that is found points to one behind it.
  std::vector<std::int64_t> next_;
};

}  // namespace

BlockRect BlocksAround(const SyncArea& area, std::uint8_t level) {
  const TileRect tiles = area.Bounds(level);
  constexpr int kBits = kTileBlockSideBits;
  const std::int64_t min_x = tiles.min_x >> kBits;
  const std::int64_t min_y = tiles.min_y >> kBits;
  return {level, min_x, min_y, (tiles.max_x >> kBits) - min_x + 1,
          (tiles.max_y >> kBits) - min_y + 1};
}

std::size_t WorkOfBlock(const SyncArea& area) {
  return std::max<std::size_t>(area.legs().size(), 1) << kTileBlockBits;
}

std::optional<std::vector<std::uint64_t>> FindBlocks(const SyncArea& area,
                                                     const BlockRect& rect,
                                                     PlanWork& work) {
  assert(area.tile_keys() == nullptr);
  BlockSearch search(area, rect, work);
  const auto* legs = area.shaping_legs();
  const bool is_done =
      legs == nullptr ? search.Everywhere()
                      : std::all_of(legs->begin(), legs->end(),
                                    [&](const SyncArea::Leg& leg) { return search.Beside(leg); });
  if (!is_done) {
    return std::nullopt;
  }
  return search.Found();
}

}  // namespace atlas
