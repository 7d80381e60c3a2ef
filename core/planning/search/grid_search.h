// A* over the nodes of a level, on eight directions. Nodes of neighbouring cells are joined when
// both are drivable and their heights differ by no more than a step; never by the layer's index. So
// ramps join decks, and a bridge is not joined to the road below.
//
// Ground: SurfaceMap or CoarseMap. Ahead: called with a node, what is left to the end from there;
// infinite where the search must not go.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "core/base/status.h"
#include "core/planning/plan_budget.h"
#include "core/planning/surface/surface_tiles.h"

namespace atlas {

template <typename Ground, typename Ahead>
class GridSearch {
 public:
  // All outlive the search; what another search left in the tiles is cleared before
  // (SurfaceTiles::ClearSearch).
  GridSearch(Ground& ground, const Ahead& ahead, PlanBudget& budget)
      : ground_(ground), tiles_(ground.tiles()), ahead_(ahead), budget_(budget) {}
  GridSearch(const GridSearch&) = delete;
  GridSearch& operator=(const GridSearch&) = delete;
  ~GridSearch() { budget_.ReleaseMemory(counted_bytes_); }

  // Errors, of this and of CloseUpTo: as of PlanBudget, and of loading tiles.
  //
  // From `start` until `end` is closed; false when nothing is left before, or `patience` nodes are
  // closed.
  Result<bool> RunTo(const NodeRef& start,
                     const NodeRef& end,
                     std::uint64_t patience = std::numeric_limits<std::uint64_t>::max()) {
    if (Status status = Begin(start); !status.ok()) {
      return Error(std::move(status));
    }
    for (; patience > 0; --patience) {
      const auto closed = Next();
      if (!closed) {
        return Error(closed.error());
      }
      if (closed->is_none() || *closed == end) {
        return !closed->is_none();
      }
    }
    return false;
  }

  // Goes on as long as ways may cost no more than `limit`.
  Status CloseUpTo(float limit) {
    while (!open_.empty() && open_.front().estimate <= limit) {
      const auto closed = Next();
      if (!closed) {
        return closed.error();
      }
    }
    return {};
  }

  // From the start to a node that was reached, both included.
  std::vector<NodeRef> WayTo(const NodeRef& end) const {
    std::vector<NodeRef> way;
    for (NodeRef ref = end; !ref.is_none(); ref = tiles_.search(ref).parent) {
      way.push_back(ref);
    }
    std::reverse(way.begin(), way.end());
    return way;
  }

 private:
  // What is left may be overestimated by what coarse cells round, so a closed node may be reached
  // at less cost after all. It is opened again for so much of its cost: for every little, some
  // worlds take a hundred times as long.
  static constexpr float kLeastGain = 0.005F;

  struct OpenNode {
    float estimate = 0.0F;
    float cost = 0.0F;
    NodeRef ref;
  };

  // Cheapest first, of equal ones the one nearer to the end; then in a fixed order.
  struct IsWorse {
    bool operator()(const OpenNode& a, const OpenNode& b) const {
      if (a.estimate != b.estimate) {
        return a.estimate > b.estimate;
      }
      if (a.cost != b.cost) {
        return a.cost < b.cost;
      }
      return a.ref.slot != b.ref.slot ? a.ref.slot > b.ref.slot : a.ref.node > b.ref.node;
    }
  };

  Status Begin(const NodeRef& start) {
    ATLAS_RETURN_IF_ERROR(tiles_.Join(start));
    ATLAS_RETURN_IF_ERROR(tiles_.PrepareSearch(start.slot));
    Reach(NodeRef(), start, 0.0F);
    return {};
  }

  // Closes the most promising node and looks around it; none when there is nothing left.
  Result<NodeRef> Next() {
    while (!open_.empty()) {
      const OpenNode top = open_.front();
      std::pop_heap(open_.begin(), open_.end(), IsWorse());
      open_.pop_back();
      SurfaceNode& node = tiles_.node(top.ref);
      if (node.Has(SurfaceNode::kClosed)) {
        continue;
      }
      node.flags |= SurfaceNode::kClosed;
      if (Status status = Expand(top.ref); !status.ok()) {
        return Error(std::move(status));
      }
      return top.ref;
    }
    return NodeRef();
  }

  Status Expand(const NodeRef& ref) {
    ATLAS_RETURN_IF_ERROR(budget_.CountExpansion());
    ATLAS_RETURN_IF_ERROR(tiles_.Join(ref));
    for (std::int32_t dy = -1; dy <= 1; ++dy) {
      for (std::int32_t dx = -1; dx <= 1; ++dx) {
        if (dx != 0 || dy != 0) {
          ATLAS_RETURN_IF_ERROR(Look(ref, dx, dy));
        }
      }
    }
    return CountOpen();
  }

  // The next cell in one direction; beyond a hole in the surface, the first one after it.
  Status Look(const NodeRef& from, std::int32_t dx, std::int32_t dy) {
    const SurfaceTile& home = tiles_.tile(from.slot);
    const SurfaceNode& node = home.nodes[from.node];
    const std::int32_t x = node.cell % tiles_.side();
    const std::int32_t y = node.cell / tiles_.side();
    for (std::int32_t cells = 1; cells <= ground_.max_cells(); ++cells) {
      const NodeRef to = tiles_.Nearest(tiles_.Cell(home, x + cells * dx, y + cells * dy),
                                        node.altitude_mm, Ground::kSameSurface_mm);
      if (to.is_none()) {
        continue;
      }
      const SurfaceNode& there = tiles_.node(to);
      const std::int32_t rise_mm = there.altitude_mm - node.altitude_mm;
      if (std::abs(rise_mm) > ground_.max_step_mm()) {
        return {};
      }
      if (!there.Has(SurfaceNode::kAnalysed)) {
        ATLAS_RETURN_IF_ERROR(ground_.Analyse(to));
      }
      if (!there.Has(SurfaceNode::kDrivable)) {
        return {};
      }
      ATLAS_RETURN_IF_ERROR(tiles_.PrepareSearch(to.slot));
      const double flat_m =
          cells * (dx != 0 && dy != 0 ? std::numbers::sqrt2 : 1.0) * tiles_.cell_m();
      const double length_m = std::sqrt(flat_m * flat_m + 1e-6 * rise_mm * rise_mm);
      Reach(from, to,
            tiles_.search(from).cost + static_cast<float>(length_m) * ground_.CostOfMetre(to));
      return {};
    }
    return {};
  }

  void Reach(const NodeRef& from, const NodeRef& to, float cost) {
    SearchNode& search = tiles_.search(to);
    SurfaceNode& node = tiles_.node(to);
    const float least_gain = node.Has(SurfaceNode::kClosed) ? kLeastGain * search.cost : 0.0F;
    if (!(cost < search.cost - least_gain)) {
      return;
    }
    if (search.ahead == SearchNode::kUnasked) {
      search.ahead = ahead_(to);
    }
    if (search.ahead == std::numeric_limits<float>::infinity()) {
      return;
    }
    search.cost = cost;
    search.parent = from;
    node.flags &= static_cast<std::uint8_t>(~SurfaceNode::kClosed);
    open_.push_back({cost + search.ahead, cost, to});
    std::push_heap(open_.begin(), open_.end(), IsWorse());
  }

  // The heap's memory, as it grows.
  Status CountOpen() {
    const std::size_t bytes = open_.capacity() * sizeof(OpenNode);
    if (bytes == counted_bytes_) {
      return {};
    }
    const std::size_t grown = bytes - counted_bytes_;
    counted_bytes_ = bytes;
    return budget_.AddMemory(grown);
  }

  Ground& ground_;
  SurfaceTiles& tiles_;
  const Ahead& ahead_;
  PlanBudget& budget_;
  std::vector<OpenNode> open_;  // a heap
  std::size_t counted_bytes_ = 0;
};

}  // namespace atlas
