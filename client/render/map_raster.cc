#include "client/render/map_raster.h"

#include <algorithm>
#include <charconv>

#include "core/base/str_cat.h"
#include "core/geometry/nibble.h"

namespace atlas {

Result<LayerChoice> LayerChoice::Parse(const std::string& text) {
  if (text == "lowest") return LayerChoice{Kind::kLowest, 0};
  if (text == "highest") return LayerChoice{Kind::kHighest, 0};
  LayerChoice choice{Kind::kNumber, 0};
  const char* end = text.data() + text.size();
  const auto [position, error] = std::from_chars(text.data(), end, choice.number);
  if (error != std::errc() || position != end) {
    return Error(StatusCode::kInvalidArgument,
                 StrCat("layer '", text.substr(0, 80),
                        "': expected lowest, highest or a number (0 is the lowest)"));
  }
  return choice;
}

const TileLayer* LayerChoice::Pick(std::span<const TileLayer> layers) const {
  if (layers.empty()) return nullptr;
  switch (kind) {
    case Kind::kLowest:
      return &layers.front();
    case Kind::kHighest:
      return &layers.back();
    case Kind::kNumber:
      return number < layers.size() ? &layers[number] : nullptr;
  }
  return nullptr;
}

void PixelBox::Add(std::int64_t x, std::int64_t y) {
  if (is_empty()) {
    *this = {x, y, x, y};
    return;
  }
  min_x = std::min(min_x, x);
  min_y = std::min(min_y, y);
  max_x = std::max(max_x, x);
  max_y = std::max(max_y, y);
}

MapRaster::MapRaster(const PixelBox& box, int shift, LayerChoice choice, const MapProfile& profile)
    : box_(box),
      shift_(shift),
      choice_(choice),
      profile_(profile),
      pixels_(static_cast<std::size_t>(box.width() * box.height())) {}

MapPixel MapRaster::PixelOf(std::span<const TileLayer> layers, const TileLayer& layer) const {
  MapPixel pixel;
  pixel.altitude_mm = layer.altitude_mm;
  pixel.occupancy = layer.occupancy;
  pixel.is_traversable = layer.is_traversable();
  pixel.layer_count = static_cast<std::uint8_t>(std::min<std::size_t>(layers.size(), 255));
  const std::int32_t base = ColumnBaseIndex(layer.altitude_mm, profile_);
  for (int i = 0; i < profile_.column_segments; ++i) {
    if (NibbleAt(layer.column, i) > kNibbleUnknown) {
      pixel.column_top_mm = (base + i + 1) * profile_.segment_height_mm - layer.altitude_mm;
    }
  }
  return pixel;
}

void MapRaster::DrawCell(std::int64_t x, std::int64_t y, std::span<const TileLayer> layers) {
  if (layers.empty() || !box_.Contains(x, y)) return;
  content_.Add(x, y);
  const TileLayer* layer = choice_.Pick(layers);
  if (layer == nullptr) return;
  MapPixel& pixel = pixels_[Index(x, y)];
  if (pixel.layer_count > 0 && pixel.altitude_mm >= layer->altitude_mm) return;
  pixel = PixelOf(layers, *layer);
}

void MapRaster::Draw(const Tile& tile) {
  const std::int64_t side = profile_.tile_cells;
  for (std::int64_t row = 0; row < side; ++row) {
    for (std::int64_t column = 0; column < side; ++column) {
      const auto layers = tile.Layers(static_cast<std::size_t>(row * side + column));
      DrawCell((tile.id.x * side + column) >> shift_, (tile.id.y * side + row) >> shift_, layers);
    }
  }
}

}  // namespace atlas
