// Which layers are open, and which are obstacles, by what the tile itself knows.
#include "core/planning/surface/surface_tile.h"

#include <cmath>
#include <utility>

#include "core/base/str_cat.h"
#include "core/geometry/nibble.h"

namespace atlas {
namespace {

// What the rules need of profile and options, in the tile's units.
struct Limits {
  std::int32_t headroom_mm;
  std::int32_t headroom_to_next_mm;  // to the surface above
  std::uint8_t occupied_state;       // the lowest that counts
  std::int32_t occupied_evidence;    // the lowest that counts
  bool is_unknown_open;
  const MapProfile& profile;
};

Limits LimitsOf(const MapProfile& profile, const PlanOptions& options) {
  const auto to_mm = [](double m) {
    return static_cast<std::int32_t>(std::lround(m * 1e3));
  };
  std::uint8_t state = kNibbleUnknown + 1;
  while (state < 15 && NibbleProbability(state) < options.occupied_probability) {
    ++state;
  }
  std::int32_t evidence = 1;
  while (evidence < kEvidenceLimit &&
         EvidenceProbability(evidence) < options.occupied_probability) {
    ++evidence;
  }
  return {to_mm(options.headroom_m),
          to_mm(options.headroom_m + options.slab_thickness_m),
          state,
          evidence,
          options.allow_unknown,
          profile};
}

// Segments are as high as a person: one counts when its middle lies below the headroom, so that the
// ceiling of a garage does not close it.
bool IsColumnInTheWay(const TileLayer& layer, const Limits& limits) {
  const std::int32_t height_mm = limits.profile.segment_height_mm;
  std::int32_t segment = 0;
  for (std::uint64_t column = layer.column; column != 0; column >>= 4, ++segment) {
    if ((column & 0xF) >= limits.occupied_state) {
      const std::int32_t middle_mm =
          (ColumnBaseIndex(layer.altitude_mm, limits.profile) + segment) * height_mm +
          height_mm / 2;
      return middle_mm - layer.altitude_mm < limits.headroom_mm;
    }
  }
  return false;
}

// Slopes seen from below leave traces of surfaces in the air over ramps, far less certain than the
// floor that was driven on: a surface above counts when it is known at least as well as this one.
bool IsCeilingLow(const TileLayer& layer, const TileLayer& above, const Limits& limits) {
  return std::int64_t{above.altitude_mm} - layer.altitude_mm < limits.headroom_to_next_mm &&
         above.sigma_100um <= layer.sigma_100um && above.observations >= layer.observations;
}

SurfaceNode MakeNode(const TileLayer& layer, const TileLayer* above, const Limits& limits) {
  SurfaceNode node;
  node.altitude_mm = layer.altitude_mm;
  const bool is_low = above != nullptr && IsCeilingLow(layer, *above, limits);
  const bool is_obstacle =
      layer.occupancy >= limits.occupied_evidence || is_low || IsColumnInTheWay(layer, limits);
  if (is_obstacle) {
    node.flags |= SurfaceNode::kObstacle;
  } else if (layer.is_traversable() || limits.is_unknown_open) {
    node.flags |= SurfaceNode::kOpen;
  }
  if ((layer.flags & TileLayer::kMeasured) != 0) {
    node.flags |= SurfaceNode::kMeasured;
  }
  return node;
}

// Of a coarser level, where something may be open beside an obstacle.
SurfaceNode MakeCoarseNode(const TileLayer& layer, const Limits& limits) {
  SurfaceNode node;
  node.altitude_mm = layer.altitude_mm;
  if ((layer.flags & TileLayer::kTraversableAny) != 0 || limits.is_unknown_open) {
    node.flags |= SurfaceNode::kOpen;
  }
  if (layer.occupancy >= limits.occupied_evidence) {
    node.flags |= SurfaceNode::kObstacle;
  }
  return node;
}

Status CheckTile(const Tile& tile, const TileId& id, const MapProfile& profile) {
  const auto cells = std::size_t{profile.tile_cells} * profile.tile_cells;
  const bool is_whole = tile.id == id && tile.cell_begin.size() == cells + 1 &&
                        tile.cell_begin.back() == tile.layers.size();
  return is_whole ? Status()
                  : Status(StatusCode::kInvalidData,
                           StrCat("plan: asked for tile ", id, " of ", cells, " cells, got ",
                                  tile.id, " of ", tile.cell_begin.size(), " offsets and ",
                                  tile.layers.size(), " layers"));
}

}  // namespace

Result<SurfaceTile> MakeSurfaceTile(const Tile& tile,
                                    const TileId& id,
                                    const MapProfile& profile,
                                    const PlanOptions& options,
                                    std::pmr::memory_resource* memory) {
  if (Status status = CheckTile(tile, id, profile); !status.ok()) {
    return Error(std::move(status));
  }
  const Limits limits = LimitsOf(profile, options);
  const std::uint32_t side = profile.tile_cells;
  const std::size_t row_words = (side + 63) / 64;
  SurfaceTile surface(memory);
  surface.id = id;
  surface.origin_x = std::int64_t{id.x} * side;
  surface.origin_y = std::int64_t{id.y} * side;
  surface.cell_begin.assign(tile.cell_begin.begin(), tile.cell_begin.end());
  surface.nodes.reserve(tile.layers.size());
  surface.obstacle_bits.resize(side * row_words);
  for (std::uint32_t cell = 0; cell < side * side; ++cell) {
    const auto layers = tile.Layers(cell);
    for (std::size_t i = 0; i < layers.size(); ++i) {
      const TileLayer* above = i + 1 < layers.size() ? &layers[i + 1] : nullptr;
      SurfaceNode node =
          id.level == 0 ? MakeNode(layers[i], above, limits) : MakeCoarseNode(layers[i], limits);
      node.cell = static_cast<std::uint16_t>(cell);
      surface.nodes.push_back(node);
      if (node.Has(SurfaceNode::kObstacle)) {
        surface.obstacle_bits[cell / side * row_words + cell % side / 64] |= std::uint64_t{1}
                                                                             << (cell % side % 64);
      }
    }
  }
  return surface;
}

}  // namespace atlas
