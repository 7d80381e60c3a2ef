// Guided where a corridor leads, else everywhere.
#include "core/planning/search/route_search.h"

#include <limits>
#include <utility>

#include "core/planning/search/ahead.h"
#include "core/planning/search/corridor.h"
#include "core/planning/search/enclosure.h"
#include "core/planning/search/grid_search.h"

namespace atlas {
namespace {

// The finest search leans so much towards the goal, the middle one towards the start
// (docs/decisions/0612-leaning-lanes.md).
constexpr float kLeaning = 1.05F;
constexpr float kLaneLeaning = 1.03F;
constexpr float kUpright = 1.0F;
// The coarse level takes for open what is not, by 2 % of a street and more at crossings: streets
// that much dearer may be the cheapest after all. Where there is no way on them, others may lead
// on.
constexpr Corridor::Width kWidths[] = {{1.05F, 20.0F}, {1.5F, 200.0F}};
// On shorter ways what coarse cells round at both ends is more than leaning may add.
constexpr double kShort_m = 20.0;
// Lanes that lean are few, and where the middle level takes for a way what is none, nothing leads
// on in them. Where something does, the finest search needs half as many nodes.
constexpr double kPatiencePerMetre = 50.0;
constexpr double kLeastPatience = 40'000.0;
constexpr std::uint64_t kEndless = std::numeric_limits<std::uint64_t>::max();

std::uint64_t Patience(double metres) {
  return static_cast<std::uint64_t>(kLeastPatience + kPatiencePerMetre * metres);
}

template <typename Ahead>
Result<std::vector<NodeRef>> Search(SurfaceMap& map,
                                    const Ahead& ahead,
                                    PlanBudget& budget,
                                    const NodeRef& start,
                                    const NodeRef& goal,
                                    std::uint64_t patience) {
  map.tiles().ClearSearch();
  GridSearch<SurfaceMap, Ahead> search(map, ahead, budget);
  const auto end = search.RunTo(start, goal, patience);
  if (!end) {
    return Error(end.error());
  }
  return *end ? search.WayTo(goal) : std::vector<NodeRef>();
}

}  // namespace

Result<std::vector<NodeRef>> RouteSearch::Run(const NodeRef& start, const NodeRef& goal) {
  if (options_.is_exhaustive) {
    return Everywhere(start, goal);
  }
  Corridor corridor(source_, profile_, options_, budget_, map_);
  auto way = Guided(corridor, start, goal);
  if (!way || !way->empty()) {
    return way;
  }
  if (!corridor.has_coarse_ends()) {
    return Everywhere(start, goal);
  }
  const auto is_enclosed = IsEnclosed(map_, goal, start, budget_);
  if (!is_enclosed) {
    return Error(is_enclosed.error());
  }
  return *is_enclosed ? std::move(way) : Everywhere(start, goal);
}

Result<std::vector<NodeRef>> RouteSearch::Guided(Corridor& corridor,
                                                 const NodeRef& start,
                                                 const NodeRef& goal) {
  for (const Corridor::Width& width : kWidths) {
    for (const float leaning : {kLaneLeaning, kUpright}) {
      const auto cost = corridor.Find(start, goal, width, leaning);
      if (!cost) {
        return Error(cost.error());
      }
      if (!*cost) {
        break;
      }
      const GuidedAhead ahead(map_.tiles(), corridor.tiles(),
                              **cost < kShort_m ? kUpright : kLeaning);
      auto way = Search(map_, ahead, budget_, start, goal,
                        leaning > kUpright ? Patience(**cost) : kEndless);
      if (!way || !way->empty()) {
        return way;
      }
    }
  }
  return std::vector<NodeRef>();
}

Result<std::vector<NodeRef>> RouteSearch::Everywhere(const NodeRef& start, const NodeRef& goal) {
  return Search(map_, StraightAhead(map_.tiles(), goal), budget_, start, goal, kEndless);
}

}  // namespace atlas
