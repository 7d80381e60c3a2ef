// A tile as a planner sees it: for each (cell, layer) one node of eight bytes.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory_resource>
#include <span>
#include <vector>

#include "core/base/status.h"
#include "core/geometry/map_profile.h"
#include "core/planning/plan_options.h"
#include "core/tile/tile.h"

namespace atlas {

struct SurfaceNode {
  static constexpr std::uint8_t kOpen = 1;       // traversable, with headroom
  static constexpr std::uint8_t kObstacle = 2;   // inflates what lies around it
  static constexpr std::uint8_t kMeasured = 4;   // its altitude can be fitted to
  static constexpr std::uint8_t kAnalysed = 8;   // kDrivable and `clearance` are known
  static constexpr std::uint8_t kDrivable = 16;  // a vehicle's middle may be here
  static constexpr std::uint8_t kClosed = 32;    // the search is done with it
  static constexpr std::uint8_t kCorridor = 64;  // a finer level's search may go here

  static constexpr std::uint8_t kFar = 255;  // no obstacle within reach

  std::int32_t altitude_mm = 0;
  std::uint16_t cell = 0;
  std::uint8_t flags = 0;
  std::uint8_t clearance = kFar;  // ObstacleClearance::Metres

  bool Has(std::uint8_t flag) const { return (flags & flag) != 0; }
};

// One node of all tiles of a level.
struct NodeRef {
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  std::uint32_t slot = kNone;  // of the tile, in loading order
  std::uint32_t node = kNone;

  bool is_none() const { return slot == kNone; }
  friend bool operator==(const NodeRef&, const NodeRef&) = default;
};

// What a search knows of a node.
struct SearchNode {
  static constexpr float kUnasked = -1.0F;

  float cost = std::numeric_limits<float>::infinity();  // of the way that led here
  float ahead = kUnasked;                               // what the search expects from here on
  NodeRef parent;
};

struct SurfaceTile {
  static constexpr std::int32_t kNotThere = -1;

  TileId id;
  std::int64_t origin_x = 0;  // of the corner cell, in cells of the level
  std::int64_t origin_y = 0;
  std::pmr::vector<std::uint32_t> cell_begin;  // as in Tile
  std::pmr::vector<SurfaceNode> nodes;         // as Tile::layers
  std::pmr::vector<SearchNode> search;         // one a node, once the search came here
  // A bit a cell, row by row: whether a node of the cell is an obstacle. 64 cells a word, each row
  // begins a new one.
  std::pmr::vector<std::uint64_t> obstacle_bits;
  // Slots of the 3 x 3 tiles around, row-major, this one in the middle; kNotThere where nobody has
  // loaded it, or it is not there.
  std::array<std::int32_t, 9> around{};
  // A bit each: those that are loaded, and those that were asked for.
  std::uint16_t linked = 0;
  std::uint16_t joined = 0;

  // `memory` outlives the tile.
  explicit SurfaceTile(std::pmr::memory_resource* memory)
      : cell_begin(memory), nodes(memory), search(memory), obstacle_bits(memory) {
    around.fill(kNotThere);
  }

  std::span<const SurfaceNode> Nodes(std::uint32_t cell) const {
    return std::span(nodes).subspan(cell_begin[cell], cell_begin[cell + 1] - cell_begin[cell]);
  }
  static std::size_t row_words(std::int32_t side) {
    return (static_cast<std::size_t>(side) + 63) / 64;
  }
  std::size_t memory_bytes() const {
    return cell_begin.capacity() * sizeof(std::uint32_t) + nodes.capacity() * sizeof(SurfaceNode) +
           obstacle_bits.capacity() * sizeof(std::uint64_t);
  }
};

// Of a level-0 tile what is open and what is an obstacle, of a coarser one, optimistically, what
// may hold anything open. kInvalidData when `tile` is not tile `id` of this profile. `memory`
// outlives the result.
Result<SurfaceTile> MakeSurfaceTile(const Tile& tile,
                                    const TileId& id,
                                    const MapProfile& profile,
                                    const PlanOptions& options,
                                    std::pmr::memory_resource* memory);

}  // namespace atlas
