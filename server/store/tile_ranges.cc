#include "server/store/tile_ranges.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace atlas {
namespace {

constexpr int kShardBits = 10;
constexpr int kCoordinateBits = 29;

// A square of 2^bits tiles a side whose lower corner is aligned to its size: its keys are
// consecutive.
struct Square {
  std::int64_t x = 0;
  std::int64_t y = 0;
  int bits = 0;

  std::int64_t side() const { return std::int64_t{1} << bits; }
};

enum class Overlap { kNone, kPart, kWhole };

Overlap OverlapOf(const Square& square, const TileRect& rect) {
  const std::int64_t last_x = square.x + square.side() - 1;
  const std::int64_t last_y = square.y + square.side() - 1;
  if (square.x > rect.max_x || last_x < rect.min_x || square.y > rect.max_y ||
      last_y < rect.min_y) {
    return Overlap::kNone;
  }
  const bool is_inside = square.x >= rect.min_x && last_x <= rect.max_x && square.y >= rect.min_y &&
                         last_y <= rect.max_y;
  return is_inside ? Overlap::kWhole : Overlap::kPart;
}

KeyRange RangeOf(const Square& square, std::uint8_t level) {
  const TileId corner{level, static_cast<std::int32_t>(square.x),
                      static_cast<std::int32_t>(square.y)};
  const auto first = static_cast<std::int64_t>(corner.Key());
  return {first, first + ((std::int64_t{1} << (2 * square.bits)) - 1)};  // the last key is 2^63 - 1
}

std::vector<Square> Overlapping(const std::vector<Square>& squares, const TileRect& rect) {
  std::vector<Square> result;
  for (const Square& square : squares) {
    if (square.bits == 0 || OverlapOf(square, rect) == Overlap::kWhole) {
      result.push_back(square);
      continue;
    }
    const Square child{square.x, square.y, square.bits - 1};
    const std::int64_t half = child.side();
    for (const auto& [dx, dy] : {std::pair{0, 0}, {1, 0}, {0, 1}, {1, 1}}) {  // key order
      const Square quarter{child.x + dx * half, child.y + dy * half, child.bits};
      if (OverlapOf(quarter, rect) != Overlap::kNone) {
        result.push_back(quarter);
      }
    }
  }
  return result;
}

}  // namespace

std::vector<KeyRange> CoverRect(const TileRect& rect, std::size_t max_ranges) {
  assert(max_ranges >= 4);
  if (rect.min_x > rect.max_x || rect.min_y > rect.max_y) {
    return {};
  }
  std::vector<Square> squares{{TileId::kMinCoordinate, TileId::kMinCoordinate, kCoordinateBits}};
  for (int step = 0; step < kCoordinateBits; ++step) {
    std::vector<Square> finer = Overlapping(squares, rect);
    if (finer.size() > max_ranges) {
      break;
    }
    squares = std::move(finer);
  }
  std::vector<KeyRange> ranges;
  for (const Square& square : squares) {
    const KeyRange range = RangeOf(square, rect.level);
    if (!ranges.empty() && ranges.back().last + 1 == range.first) {
      ranges.back().last = range.last;
    } else {
      ranges.push_back(range);
    }
  }
  return ranges;
}

KeyRange LevelRange(std::uint8_t level) {
  return RangeOf({TileId::kMinCoordinate, TileId::kMinCoordinate, kCoordinateBits}, level);
}

KeyRange Level0Range(const TileId& id) {
  const std::int64_t side = std::int64_t{1} << id.level;
  return RangeOf({id.x * side, id.y * side, id.level}, 0);
}

TileRect Level0Rect(const TileRect& rect) {
  const auto first = [&rect](std::int64_t coordinate) {
    const std::int64_t scaled = coordinate * (std::int64_t{1} << rect.level);
    return static_cast<std::int32_t>(
        std::clamp<std::int64_t>(scaled, TileId::kMinCoordinate, TileId::kMaxCoordinate));
  };
  const auto last = [&rect](std::int64_t coordinate) {
    const std::int64_t scaled = (coordinate + 1) * (std::int64_t{1} << rect.level) - 1;
    return static_cast<std::int32_t>(
        std::clamp<std::int64_t>(scaled, TileId::kMinCoordinate, TileId::kMaxCoordinate));
  };
  return {0, first(rect.min_x), first(rect.min_y), last(rect.max_x), last(rect.max_y)};
}

TileId AncestorOf(const TileId& level0, std::uint8_t level) {
  return {level, level0.x >> level, level0.y >> level};
}

std::int64_t ShardOf(const TileId& id) {
  TileId region = id;
  if (id.level < kShardBits) {
    const int shift = kShardBits - id.level;
    region = {kShardBits, id.x >> shift, id.y >> shift};
  }
  return static_cast<std::int64_t>(region.Key());
}

}  // namespace atlas
