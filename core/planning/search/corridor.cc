// The coarse level is searched from the start, the middle one from the goal along what that closed.
#include "core/planning/search/corridor.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/planning/search/ahead.h"
#include "core/planning/search/grid_search.h"

namespace atlas {
namespace {

// Streets are some of the coarse level's cells wide, and a middle cell is less than a vehicle, so
// that obstacles beside it close it.
constexpr double kMiddleCell_m = 0.4;
constexpr int kLevelsToStreets = 3;
// Of the middle level, which is checked with the finest: what a search leaning towards the goal
// may need beside the cheapest way.
constexpr float kDearerLanes_m = 4.0F;

std::uint8_t MiddleLevel(const MapProfile& profile) {
  std::uint8_t level = 1;
  while (AtLevel(profile.cell_size_m(), level + 1) <= kMiddleCell_m + 1e-9) {
    ++level;
  }
  return level;
}

void MarkClosed(SurfaceTiles& tiles) {
  for (std::uint32_t slot = 0; slot < tiles.size(); ++slot) {
    for (SurfaceNode& node : tiles.tile(slot).nodes) {
      if (node.Has(SurfaceNode::kClosed)) {
        node.flags |= SurfaceNode::kCorridor;
      }
    }
  }
}

// Those at the edge, too: a way that leads on from there is known, if not the cheapest.
void MarkReached(SurfaceTiles& tiles) {
  for (std::uint32_t slot = 0; slot < tiles.size(); ++slot) {
    SurfaceTile& tile = tiles.tile(slot);
    for (std::size_t i = 0; i < tile.search.size(); ++i) {
      if (tile.search[i].cost < std::numeric_limits<float>::infinity()) {
        tile.nodes[i].flags |= SurfaceNode::kCorridor;
      }
    }
  }
}

}  // namespace

Corridor::Corridor(TileSource& source,
                   const MapProfile& profile,
                   const PlanOptions& options,
                   PlanBudget& budget,
                   SurfaceMap& map)
    : budget_(budget), map_(map) {
  const std::uint8_t middle = MiddleLevel(profile);
  const auto coarse =
      static_cast<std::uint8_t>(std::min<int>(middle + kLevelsToStreets, profile.levels - 1));
  if (coarse > middle) {
    coarse_.emplace(source, profile, options, budget, coarse);
    middle_.emplace(source, profile, options, budget, middle);
    middle_->CheckWith(map);
  }
}

Result<std::optional<double>> Corridor::Find(const NodeRef& start,
                                             const NodeRef& goal,
                                             const Width& width,
                                             float leaning) {
  if (!coarse_) {
    return std::nullopt;
  }
  const auto has_streets = FindStreets(start, goal, width);
  if (!has_streets) {
    return Error(has_streets.error());
  }
  return *has_streets ? FindLanes(start, goal, leaning) : std::nullopt;
}

Result<bool> Corridor::FindStreets(const NodeRef& start, const NodeRef& goal, const Width& width) {
  const auto from = coarse_->Above(map_.tiles(), start);
  const auto to = coarse_->Above(map_.tiles(), goal);
  if (!from || !to) {
    return Error(!from ? from.error() : to.error());
  }
  if (from->is_none() || to->is_none()) {
    return false;
  }
  has_coarse_ends_ = true;
  coarse_->tiles().ClearSearch();
  const StraightAhead ahead(coarse_->tiles(), *to);
  GridSearch<CoarseMap, StraightAhead> search(*coarse_, ahead, budget_);
  const auto is_found = search.RunTo(*from, *to);
  if (!is_found || !*is_found) {
    return is_found;
  }
  const float limit = width.factor * coarse_->tiles().cost(*to) + width.metres;
  if (Status status = search.CloseUpTo(limit); !status.ok()) {
    return Error(std::move(status));
  }
  MarkClosed(coarse_->tiles());
  return true;
}

Result<std::optional<double>> Corridor::FindLanes(const NodeRef& start,
                                                  const NodeRef& goal,
                                                  float leaning) {
  const auto from = middle_->Above(map_.tiles(), goal);
  const auto to = middle_->Above(map_.tiles(), start);
  if (!from || !to) {
    return Error(!from ? from.error() : to.error());
  }
  if (from->is_none() || to->is_none()) {
    return std::nullopt;
  }
  middle_->tiles().ClearSearch();
  const GuidedAhead ahead(middle_->tiles(), coarse_->tiles(), leaning);
  GridSearch<CoarseMap, GuidedAhead> search(*middle_, ahead, budget_);
  const auto is_found = search.RunTo(*from, *to);
  if (!is_found) {
    return Error(is_found.error());
  }
  if (!*is_found) {
    return std::nullopt;
  }
  const double least = middle_->tiles().cost(*to);
  if (Status status = search.CloseUpTo(static_cast<float>(least) + kDearerLanes_m); !status.ok()) {
    return Error(std::move(status));
  }
  MarkReached(middle_->tiles());
  return least;
}

}  // namespace atlas
