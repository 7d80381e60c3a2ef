// From each corner the farthest line that fits, found by doubling and halving.
#include "core/planning/route/straightening.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace atlas {
namespace {

// No line is longer, in nodes of the way: 60 m, of which a few are tried at each corner.
constexpr std::size_t kMaxNodes = 600;

class Straightener {
 public:
  Straightener(SurfaceMap& map, const std::vector<NodeRef>& way) : map_(map), way_(way) {
    costs_.push_back(0.0);
    for (std::size_t i = 1; i < way.size(); ++i) {
      const double length_m =
          (PositionOf(map.tiles(), way[i]) - PositionOf(map.tiles(), way[i - 1])).norm();
      costs_.push_back(costs_.back() + length_m * static_cast<double>(map.CostOfMetre(way[i])));
    }
  }

  double cost() const { return costs_.back(); }

  // Where the line from `begin` leads, and the line; the next node at least.
  Result<std::pair<std::size_t, SurfaceLine>> Farthest(std::size_t begin) {
    const std::size_t last = std::min(way_.size() - 1, begin + kMaxNodes);
    std::pair<std::size_t, SurfaceLine> best{begin + 1, Step(begin)};
    std::size_t reach = 2;
    for (bool is_growing = true; reach > 0;) {
      const std::size_t end = std::min(last, is_growing ? begin + reach : best.first + reach);
      bool fits = false;
      if (end > best.first) {
        auto line = FollowLine(map_, way_[begin], way_[end], costs_[end] - costs_[begin]);
        if (!line) {
          return Error(line.error());
        }
        fits = line->has_value();
        if (fits) {
          best = {end, std::move(**line)};
        }
      }
      is_growing = is_growing && fits && end < last;
      reach = is_growing ? 2 * reach : reach / 2;
    }
    return best;
  }

 private:
  SurfaceLine Step(std::size_t begin) const {
    SurfaceLine line;
    for (const std::size_t i : {begin, begin + 1}) {
      line.points.push_back({way_[i], PositionOf(map_.tiles(), way_[i])});
    }
    line.cost = costs_[begin + 1] - costs_[begin];
    return line;
  }

  SurfaceMap& map_;
  const std::vector<NodeRef>& way_;
  std::vector<double> costs_;  // from the start to each node
};

}  // namespace

Result<StraightWay> Straighten(SurfaceMap& map, const std::vector<NodeRef>& way) {
  StraightWay straight;
  if (way.empty()) {
    return straight;
  }
  Straightener straightener(map, way);
  straight.searched_cost = straightener.cost();
  straight.points.push_back({way.front(), PositionOf(map.tiles(), way.front())});
  straight.corners.push_back(0);
  for (std::size_t at = 0; at + 1 < way.size();) {
    const auto line = straightener.Farthest(at);
    if (!line) {
      return Error(line.error());
    }
    straight.points.insert(straight.points.end(), line->second.points.begin() + 1,
                           line->second.points.end());
    straight.corners.push_back(straight.points.size() - 1);
    straight.cost += line->second.cost;
    at = line->first;
  }
  return straight;
}

}  // namespace atlas
