// Steps are taken backwards, and more of them than a search takes: any layer within a step counts,
// whatever lies between. So what this does not reach leads nowhere near the goal.
#include "core/planning/search/enclosure.h"

#include <cstdlib>
#include <unordered_set>
#include <utility>
#include <vector>

namespace atlas {
namespace {

// As many as a search closes in some 20 ms: a yard of 200 m^2.
constexpr std::size_t kMaxNodes = 20'000;

class BackwardFlood {
 public:
  BackwardFlood(SurfaceMap& map, PlanBudget& budget) : map_(map), budget_(budget) {}

  void Reach(const NodeRef& ref) {
    if (reached_.insert((std::uint64_t{ref.slot} << 32) | ref.node).second) {
      open_.push_back(ref);
    }
  }
  bool is_over() const { return open_.empty(); }
  std::size_t size() const { return reached_.size(); }

  // The node looked around.
  Result<NodeRef> Next() {
    const NodeRef ref = open_.back();
    open_.pop_back();
    if (Status status = budget_.CountExpansion(); !status.ok()) {
      return Error(std::move(status));
    }
    for (std::int32_t direction = 0; direction < 9; ++direction) {
      for (std::int32_t cells = 1; direction != 4 && cells <= map_.max_cells(); ++cells) {
        const Status status = LookAt(ref, cells * (direction % 3 - 1), cells * (direction / 3 - 1));
        if (!status.ok()) {
          return Error(status);
        }
      }
    }
    return ref;
  }

 private:
  Status LookAt(const NodeRef& ref, std::int32_t dx, std::int32_t dy) {
    SurfaceTiles& tiles = map_.tiles();
    ATLAS_RETURN_IF_ERROR(tiles.Join(ref));
    const std::int32_t altitude_mm = tiles.node(ref).altitude_mm;
    const std::int32_t cell = tiles.node(ref).cell;
    const CellNodes beside =
        tiles.Cell(tiles.tile(ref.slot), cell % tiles.side() + dx, cell / tiles.side() + dy);
    for (std::uint32_t i = beside.begin; i < beside.end; ++i) {
      const NodeRef other{beside.slot, i};
      if (std::abs(tiles.node(other).altitude_mm - altitude_mm) > map_.max_step_mm()) {
        continue;
      }
      ATLAS_RETURN_IF_ERROR(map_.Analyse(other));
      if (tiles.node(other).Has(SurfaceNode::kDrivable)) {
        Reach(other);
      }
    }
    return {};
  }

  SurfaceMap& map_;
  PlanBudget& budget_;
  std::unordered_set<std::uint64_t> reached_;
  std::vector<NodeRef> open_;
};

}  // namespace

Result<bool> IsEnclosed(SurfaceMap& map,
                        const NodeRef& goal,
                        const NodeRef& start,
                        PlanBudget& budget) {
  BackwardFlood flood(map, budget);
  flood.Reach(goal);
  while (!flood.is_over() && flood.size() < kMaxNodes) {
    const auto ref = flood.Next();
    if (!ref) {
      return Error(ref.error());
    }
    if (*ref == start) {
      return false;
    }
  }
  return flood.is_over();
}

}  // namespace atlas
