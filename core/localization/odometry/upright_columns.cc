#include "core/localization/odometry/upright_columns.h"

#include <algorithm>
#include <cstddef>
#include <tuple>
#include <utility>

#include "core/base/fast_floor.h"

namespace atlas {

std::vector<Eigen::Vector3f> UprightColumns(const std::vector<Eigen::Vector3f>& columns) {
  constexpr float kCell_m = 0.5F;
  constexpr float kLeast_m = 0.4F;  // from its lowest return to its highest
  struct Placed {
    std::pair<int, int> cell;
    std::size_t index;
  };
  std::vector<Placed> placed;
  placed.reserve(columns.size());
  for (std::size_t i = 0; i < columns.size(); ++i) {
    placed.push_back(
        {{FastFloor(columns[i].x() / kCell_m), FastFloor(columns[i].y() / kCell_m)}, i});
  }
  std::sort(placed.begin(), placed.end(), [](const Placed& a, const Placed& b) {
    return std::tie(a.cell, a.index) < std::tie(b.cell, b.index);
  });
  std::vector<Eigen::Vector3f> upright;
  for (auto begin = placed.begin(); begin != placed.end();) {
    const auto end = std::find_if(begin, placed.end(),
                                  [&](const Placed& other) { return other.cell != begin->cell; });
    const auto [low, high] = std::minmax_element(begin, end, [&](const Placed& a, const Placed& b) {
      return columns[a.index].z() < columns[b.index].z();
    });
    if (columns[high->index].z() - columns[low->index].z() >= kLeast_m) {
      for (; begin != end; ++begin) upright.push_back(columns[begin->index]);
    }
    begin = end;
  }
  return upright;
}

}  // namespace atlas
