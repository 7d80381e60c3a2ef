#include "core/localization/window/place_content.h"

#include <algorithm>

#include "core/geometry/nibble.h"

namespace atlas {
namespace {

bool IsMeasured(const TileLayer& layer) {
  return (layer.flags & TileLayer::kMeasured) != 0;
}

}  // namespace

struct PlaceContent::Lattice {
  const MapProfile& profile;
  std::int64_t first_segment;
  double first_z_m;
  const ContentOptions& options;
};

void PlaceContent::Clear() {
  occupied_.clear();
  free_.clear();
  begin_.clear();
  heights_m_.clear();
  has_occupied_ = false;
}

void PlaceContent::Read(const Tile& tile,
                        const TileId& place,
                        const MapProfile& profile,
                        std::int64_t first_segment,
                        const ContentOptions& options) {
  Clear();
  const std::int64_t side = profile.tile_cells;
  const Lattice lattice{profile, first_segment,
                        static_cast<double>(first_segment) * profile.segment_height_m(), options};
  const auto cells = static_cast<std::size_t>(side * side);
  occupied_.assign(cells, 0);
  free_.assign(cells, 0);
  begin_.reserve(cells + 1);
  // Of the place's first cell in the tile, counted in cells of level 0.
  const std::int64_t left =
      side * (std::int64_t{place.x} - (std::int64_t{tile.id.x} << tile.id.level));
  const std::int64_t low =
      side * (std::int64_t{place.y} - (std::int64_t{tile.id.y} << tile.id.level));
  for (std::int64_t j = 0; j < side; ++j) {
    const std::int64_t row = side * ((low + j) >> tile.id.level);
    for (std::int64_t i = 0; i < side; ++i) {
      begin_.push_back(static_cast<std::uint32_t>(heights_m_.size()));
      AddCell(tile.Layers(static_cast<std::size_t>(row + ((left + i) >> tile.id.level))),
              static_cast<std::size_t>(j * side + i), lattice);
    }
  }
  begin_.push_back(static_cast<std::uint32_t>(heights_m_.size()));
}

void PlaceContent::AddCell(std::span<const TileLayer> layers,
                           std::size_t cell,
                           const Lattice& lattice) {
  const bool is_any_measured = std::any_of(layers.begin(), layers.end(), IsMeasured);
  for (const TileLayer& layer : layers) {
    if (is_any_measured && !IsMeasured(layer)) {
      continue;  // what stands there does so at a guessed height
    }
    if (layer.is_traversable() && IsMeasured(layer)) {
      heights_m_.push_back(static_cast<float>(layer.altitude_mm * 1e-3 - lattice.first_z_m));
    }
    AddColumn(layer, cell, lattice);
  }
  has_occupied_ = has_occupied_ || occupied_[cell] != 0;
}

void PlaceContent::AddColumn(const TileLayer& layer, std::size_t cell, const Lattice& lattice) {
  const std::int64_t base =
      ColumnBaseIndex(layer.altitude_mm, lattice.profile) - lattice.first_segment;
  for (int k = 0; k < lattice.profile.column_segments; ++k) {
    const std::int64_t bit = base + k;
    const std::uint8_t nibble = NibbleAt(layer.column, k);
    if (nibble == 0 || bit < 0 || bit >= WindowGrid::kSegments) {
      continue;
    }
    if (nibble >= lattice.options.occupied_nibble) {
      occupied_[cell] |= std::uint64_t{1} << bit;
    } else if (nibble <= lattice.options.free_nibble) {
      free_[cell] |= std::uint64_t{1} << bit;
    }
  }
}

}  // namespace atlas
