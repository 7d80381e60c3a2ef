// Expansion, costs and the heap.
#include "core/planning/route_search.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

// A layer this near in height belongs to the surface driven on, even where it cannot be driven.
constexpr std::int32_t kSameSurface_mm = 1'000;

// Cheapest first; equal ones in a fixed order.
struct IsWorse {
  template <typename Node>
  bool operator()(const Node& a, const Node& b) const {
    if (a.estimate != b.estimate) {
      return a.estimate > b.estimate;
    }
    return a.ref.slot != b.ref.slot ? a.ref.slot > b.ref.slot : a.ref.node > b.ref.node;
  }
};

}  // namespace

RouteSearch::RouteSearch(SurfaceMap& map, const MapProfile& profile, const PlanOptions& options)
    : map_(map),
      profile_(profile),
      options_(options),
      max_cells_(1 + static_cast<std::int32_t>(options.max_gap_m / profile.cell_size_m() + 1e-9)),
      max_step_mm_(static_cast<std::int32_t>(std::lround(options.max_step_m * 1e3))) {}

Eigen::Vector3d RouteSearch::Position(const NodeRef& ref) const {
  const SurfaceTile& tile = map_.tile(ref.slot);
  const SurfaceNode& node = tile.nodes[ref.node];
  const std::int64_t side = profile_.tile_cells;
  const double cell_m = profile_.cell_size_m();
  const std::int64_t x = tile.id.x * side + node.cell % side;
  const std::int64_t y = tile.id.y * side + node.cell / side;
  return {(static_cast<double>(x) + 0.5) * cell_m, (static_cast<double>(y) + 0.5) * cell_m,
          1e-3 * node.altitude_mm};
}

// No way along the eight directions is shorter, so it never overestimates.
double RouteSearch::Heuristic(const Eigen::Vector3d& position) const {
  const Eigen::Vector3d d = (goal_ - position).cwiseAbs();
  const double octile_m =
      std::max(d.x(), d.y()) + (std::numbers::sqrt2 - 1.0) * std::min(d.x(), d.y());
  return std::hypot(octile_m, d.z());
}

Status RouteSearch::Push(float estimate, const NodeRef& ref) {
  open_.push_back({estimate, ref});
  std::push_heap(open_.begin(), open_.end(), IsWorse());
  if (map_.memory_bytes() + open_.capacity() * sizeof(OpenNode) > options_.max_memory_bytes) {
    return Status(StatusCode::kResourceExhausted,
                  StrCat("plan: the search needs more than the limit of ",
                         options_.max_memory_bytes, " bytes"));
  }
  return {};
}

NodeRef RouteSearch::Pop() {
  std::pop_heap(open_.begin(), open_.end(), IsWorse());
  const NodeRef ref = open_.back().ref;
  open_.pop_back();
  return ref;
}

Result<std::vector<NodeRef>> RouteSearch::Run(const NodeRef& start, const NodeRef& goal) {
  goal_ = Position(goal);
  if (Status status = Relax(start, start, 0.0); !status.ok()) {
    return Error(std::move(status));
  }
  while (!open_.empty()) {
    const NodeRef ref = Pop();
    SurfaceNode& node = map_.node(ref);
    if (node.Has(SurfaceNode::kClosed)) {
      continue;
    }
    node.flags |= SurfaceNode::kClosed;
    if (ref == goal) {
      cost_ = map_.tile(ref.slot).search[ref.node].cost;
      return WayTo(goal);
    }
    if (Status status = Expand(ref); !status.ok()) {
      return Error(std::move(status));
    }
  }
  return std::vector<NodeRef>();
}

Status RouteSearch::Expand(const NodeRef& ref) {
  if (++expansions_ > options_.max_expansions) {
    return Status(StatusCode::kResourceExhausted,
                  StrCat("plan: no route within the limit of ", options_.max_expansions,
                         " expansions; expected a nearer goal or a higher limit"));
  }
  ATLAS_RETURN_IF_ERROR(map_.MakeReady(ref.slot));
  for (std::int32_t dy = -1; dy <= 1; ++dy) {
    for (std::int32_t dx = -1; dx <= 1; ++dx) {
      if (dx != 0 || dy != 0) {
        ATLAS_RETURN_IF_ERROR(Look(ref, dx, dy));
      }
    }
  }
  return {};
}

// The next cell in one direction; beyond a hole in the surface, the first one after it.
Status RouteSearch::Look(const NodeRef& from, std::int32_t dx, std::int32_t dy) {
  const SurfaceTile& home = map_.tile(from.slot);
  const std::int32_t altitude_mm = home.nodes[from.node].altitude_mm;
  const std::int32_t x = home.nodes[from.node].cell % profile_.tile_cells;
  const std::int32_t y = home.nodes[from.node].cell / profile_.tile_cells;
  for (std::int32_t cells = 1; cells <= max_cells_; ++cells) {
    const CellNodes cell = map_.Cell(home, x + cells * dx, y + cells * dy);
    std::int64_t nearest_mm = kSameSurface_mm;
    NodeRef nearest;
    for (std::uint32_t i = cell.begin; i < cell.end; ++i) {
      const NodeRef candidate{cell.slot, i};
      const std::int64_t apart_mm =
          std::abs(std::int64_t{map_.node(candidate).altitude_mm} - altitude_mm);
      if (apart_mm < nearest_mm) {
        nearest_mm = apart_mm;
        nearest = candidate;
      }
    }
    if (nearest.is_none()) {
      continue;
    }
    if (nearest_mm > max_step_mm_ || map_.node(nearest).Has(SurfaceNode::kClosed)) {
      return {};
    }
    ATLAS_RETURN_IF_ERROR(map_.MakeReady(nearest.slot));
    if (!map_.IsDrivable(nearest)) {
      return {};
    }
    const double diagonal = dx != 0 && dy != 0 ? std::numbers::sqrt2 : 1.0;
    return Relax(from, nearest, cells * diagonal * profile_.cell_size_m());
  }
  return {};
}

// `flat_m` in plan; a node is relaxed from itself to start with.
Status RouteSearch::Relax(const NodeRef& from, const NodeRef& to, double flat_m) {
  ATLAS_RETURN_IF_ERROR(map_.PrepareSearch(to.slot));
  const SurfaceNode& node = map_.node(to);
  double cost = 0.0;
  if (from != to) {
    const double rise_m = 1e-3 * (node.altitude_mm - map_.node(from).altitude_mm);
    const double spare_m = map_.Clearance(node) - options_.inflation_m();
    const double crowding =
        options_.comfort_m > 0.0 ? std::clamp(1.0 - spare_m / options_.comfort_m, 0.0, 1.0) : 0.0;
    cost =
        static_cast<double>(map_.tile(from.slot).search[from.node].cost) +
        std::sqrt(flat_m * flat_m + rise_m * rise_m) * (1.0 + options_.comfort_weight * crowding);
  }
  SearchNode& search = map_.tile(to.slot).search[to.node];
  if (static_cast<float>(cost) >= search.cost) {
    return {};
  }
  search.cost = static_cast<float>(cost);
  search.parent = from == to ? NodeRef() : from;
  return Push(static_cast<float>(cost + Heuristic(Position(to))), to);
}

std::vector<NodeRef> RouteSearch::WayTo(const NodeRef& goal) const {
  std::vector<NodeRef> way;
  for (NodeRef ref = goal; !ref.is_none(); ref = map_.tile(ref.slot).search[ref.node].parent) {
    way.push_back(ref);
  }
  std::reverse(way.begin(), way.end());
  return way;
}

}  // namespace atlas
