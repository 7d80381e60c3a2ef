// All tiles of a map, decoded and open to changes.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "client/map/map_source.h"
#include "core/base/integer_math.h"
#include "core/geometry/nibble.h"
#include "core/geometry/tile_id.h"
#include "core/tile/tile.h"
#include "core/tile/tile_codec.h"
#include "tests/bench/monitoring/changed_segments.h"

namespace atlas::testing {

inline constexpr std::uint8_t kOccupiedFrom = 10;
inline constexpr std::uint8_t kFreeTo = 6;

inline bool IsOccupied(std::uint8_t nibble) {
  return nibble >= kOccupiedFrom;
}
inline bool IsFree(std::uint8_t nibble) {
  return nibble != 0 && nibble <= kFreeTo;
}

inline bool IsMeasured(const TileLayer& layer) {
  return (layer.flags & TileLayer::kMeasured) != 0;
}

inline void SetNibble(TileLayer& layer, int k, std::uint8_t nibble) {
  layer.column &= ~(std::uint64_t{15} << (4 * k));
  layer.column |= std::uint64_t{nibble} << (4 * k);
}

// The surface says what its lowest segments do.
inline void SetSurface(TileLayer& layer, bool is_obstacle) {
  layer.occupancy = static_cast<std::int8_t>(is_obstacle ? kEvidenceLimit : -kEvidenceLimit);
  constexpr std::uint8_t kFree = TileLayer::kTraversable | TileLayer::kTraversableAny;
  layer.flags = static_cast<std::uint8_t>(is_obstacle ? layer.flags & ~kFree : layer.flags | kFree);
}

struct OpenLayer {
  TileLayer& layer;
  ChangePart& part;
  Eigen::Vector2d p = Eigen::Vector2d::Zero();  // the cell's middle
  bool is_believed = true;                      // not at a guessed height beside measured ones
};

struct Square {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  Eigen::Vector2d half = Eigen::Vector2d::Zero();

  bool Contains(const Eigen::Vector2d& p) const {
    return ((p - center).cwiseAbs().array() <= half.array()).all();
  }
};

class OpenMap {
 public:
  explicit OpenMap(const MapProfile& profile) : profile_(profile) {}

  Status Read(MapSource& source) {
    return source.ReadLevel(0, std::nullopt, [&](const TileBlob& blob) -> Status {
      auto tile = DecodeTile(blob.blob, profile_);
      if (!tile) return tile.error();
      parts_[blob.id].assign(tile->layers.size(), ChangePart::kColumns);
      tiles_[blob.id] = *std::move(tile);
      return {};
    });
  }

  // Calls visit(OpenLayer) for all layers of every cell within.
  template <typename Visit>
  void ForEachIn(const Square& square, Visit&& visit) {
    const double cell_m = profile_.cell_size_m();
    const std::int64_t side = profile_.tile_cells;
    const auto index = [cell_m](double v) {
      return static_cast<std::int64_t>(std::floor(v / cell_m));
    };
    const Eigen::Vector2d low = square.center - square.half;
    const Eigen::Vector2d high = square.center + square.half;
    for (std::int64_t y = index(low.y()); y <= index(high.y()); ++y) {
      for (std::int64_t x = index(low.x()); x <= index(high.x()); ++x) {
        const auto tile = tiles_.find({0, static_cast<std::int32_t>(FloorDiv(x, side)),
                                       static_cast<std::int32_t>(FloorDiv(y, side))});
        if (tile == tiles_.end()) continue;
        const auto cell =
            static_cast<std::size_t>((y - tile->first.y * side) * side + x - tile->first.x * side);
        const Eigen::Vector2d middle((static_cast<double>(x) + 0.5) * cell_m,
                                     (static_cast<double>(y) + 0.5) * cell_m);
        VisitCell(tile->second, parts_[tile->first], cell, middle, visit);
      }
    }
  }
  template <typename Visit>
  void ForEach(Visit&& visit) {
    const double cell_m = profile_.cell_size_m();
    const std::int64_t side = profile_.tile_cells;
    for (auto& [id, tile] : tiles_) {
      for (std::size_t cell = 0; cell + 1 < tile.cell_begin.size(); ++cell) {
        const std::int64_t x = id.x * side + static_cast<std::int64_t>(cell) % side;
        const std::int64_t y = id.y * side + static_cast<std::int64_t>(cell) / side;
        VisitCell(tile, parts_[id], cell,
                  Eigen::Vector2d((static_cast<double>(x) + 0.5) * cell_m,
                                  (static_cast<double>(y) + 0.5) * cell_m),
                  visit);
      }
    }
  }

  const std::map<TileId, Tile>& tiles() const { return tiles_; }
  ChangePart part(const TileId& id, std::size_t layer) const { return parts_.at(id)[layer]; }

 private:
  template <typename Visit>
  static void VisitCell(Tile& tile,
                        std::vector<ChangePart>& parts,
                        std::size_t cell,
                        const Eigen::Vector2d& middle,
                        const Visit& visit) {
    const auto layers = tile.Layers(cell);
    const bool is_none_measured = std::none_of(layers.begin(), layers.end(), IsMeasured);
    for (std::size_t i = tile.cell_begin[cell]; i < tile.cell_begin[cell + 1]; ++i) {
      visit(OpenLayer{tile.layers[i], parts[i], middle,
                      is_none_measured || IsMeasured(tile.layers[i])});
    }
  }

  MapProfile profile_;
  std::map<TileId, Tile> tiles_;
  std::map<TileId, std::vector<ChangePart>> parts_;  // by layer
};

}  // namespace atlas::testing
