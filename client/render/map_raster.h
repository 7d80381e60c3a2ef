// The map as a grid of pixels, one chosen layer each: between tiles, which come in any order, and a
// picture.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "core/geometry/map_profile.h"
#include "core/tile/tile.h"

namespace atlas {

// Which of a cell's layers is shown.
struct LayerChoice {
  enum class Kind { kLowest, kHighest, kNumber };
  Kind kind = Kind::kHighest;
  std::uint32_t number = 0;  // 0 is the lowest; cells with fewer layers stay blank

  // "lowest", "highest" or a number.
  static Result<LayerChoice> Parse(const std::string& text);
  // Null when the cell has no such layer.
  const TileLayer* Pick(std::span<const TileLayer> layers) const;
};

struct MapPixel {
  std::int32_t altitude_mm = 0;
  std::int32_t column_top_mm = 0;  // above the layer; 0: nothing occupied stands here
  std::uint8_t layer_count = 0;    // of the cell, saturating; 0: blank
  std::int8_t occupancy = 0;       // evidence, nibble.h
  bool is_traversable = false;
};

// Pixels by (x, y) of the world, y up; pixel (x, y) covers [x, x+1) x [y, y+1) pixel sizes.
struct PixelBox {
  std::int64_t min_x = 0;
  std::int64_t min_y = 0;
  std::int64_t max_x = -1;  // inclusive; empty when below the minimum
  std::int64_t max_y = -1;

  bool is_empty() const { return max_x < min_x || max_y < min_y; }
  std::int64_t width() const { return is_empty() ? 0 : max_x - min_x + 1; }
  std::int64_t height() const { return is_empty() ? 0 : max_y - min_y + 1; }
  bool Contains(std::int64_t x, std::int64_t y) const {
    return x >= min_x && x <= max_x && y >= min_y && y <= max_y;
  }
  void Add(std::int64_t x, std::int64_t y);
};

class MapRaster {
 public:
  // `shift`: a pixel is 2^shift cells of the tiles drawn. Memory is the box's area.
  MapRaster(const PixelBox& box, int shift, LayerChoice choice, const MapProfile& profile);

  // Cells outside of the box are left out. Of several cells in one pixel the highest counts.
  void Draw(const Tile& tile);

  const PixelBox& box() const { return box_; }
  // The smallest box around the cells drawn that have any layer, chosen or not: pictures of
  // different layers have the same frame.
  const PixelBox& content() const { return content_; }
  // Requires box().Contains(x, y).
  const MapPixel& at(std::int64_t x, std::int64_t y) const { return pixels_[Index(x, y)]; }

 private:
  std::size_t Index(std::int64_t x, std::int64_t y) const {
    return static_cast<std::size_t>((y - box_.min_y) * box_.width() + (x - box_.min_x));
  }
  MapPixel PixelOf(std::span<const TileLayer> layers, const TileLayer& layer) const;
  void DrawCell(std::int64_t x, std::int64_t y, std::span<const TileLayer> layers);

  PixelBox box_;
  PixelBox content_;
  int shift_;
  LayerChoice choice_;
  MapProfile profile_;
  std::vector<MapPixel> pixels_;
};

}  // namespace atlas
