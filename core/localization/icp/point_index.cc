#include "core/localization/icp/point_index.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <nanoflann.hpp>

namespace atlas {
namespace {

struct Points {
  std::vector<Eigen::Vector3f> points;

  // What nanoflann asks of a cloud.
  std::size_t kdtree_get_point_count() const { return points.size(); }
  float kdtree_get_pt(std::uint32_t i, std::size_t axis) const {
    return points[i](static_cast<Eigen::Index>(axis));
  }
  template <typename Box>
  bool kdtree_get_bbox(Box& /*box*/) const {
    return false;
  }
};

using KdTree = nanoflann::
    KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Points>, Points, 3, std::uint32_t>;

// The nearest point within a reach: a result set in nanoflann's sense.
class NearestOne {
 public:
  using DistanceType = float;

  explicit NearestOne(float reach_m) : distance2_(reach_m * reach_m) {}

  std::size_t size() const { return is_found_ ? 1 : 0; }
  bool full() const { return true; }  // what is farther than worstDist() is of no use
  float worstDist() const { return distance2_; }
  bool addPoint(float distance2, std::uint32_t index) {
    if (distance2 < distance2_) {
      distance2_ = distance2;
      index_ = index;
      is_found_ = true;
    }
    return true;
  }

  std::optional<NearPoint> found() const {
    return is_found_ ? std::optional(NearPoint{index_, std::sqrt(distance2_)}) : std::nullopt;
  }

 private:
  float distance2_;
  std::uint32_t index_ = 0;
  bool is_found_ = false;
};

constexpr std::size_t kLeafPoints = 16;

}  // namespace

struct PointIndex::Tree {
  explicit Tree(std::vector<Eigen::Vector3f> points)
      : cloud{std::move(points)}, tree(3, cloud, {kLeafPoints}) {}

  Points cloud;
  KdTree tree;
};

PointIndex::PointIndex(std::vector<Eigen::Vector3f> points)
    : tree_(std::make_unique<Tree>(std::move(points))) {}
PointIndex::PointIndex(PointIndex&&) noexcept = default;
PointIndex& PointIndex::operator=(PointIndex&&) noexcept = default;
PointIndex::~PointIndex() = default;

const std::vector<Eigen::Vector3f>& PointIndex::points() const {
  return tree_->cloud.points;
}

std::optional<NearPoint> PointIndex::Nearest(const Eigen::Vector3f& p, float reach_m) const {
  if (is_empty()) return std::nullopt;
  NearestOne nearest(reach_m);
  tree_->tree.findNeighbors(nearest, p.data(), {});
  return nearest.found();
}

void PointIndex::Nearest(const Eigen::Vector3f& p,
                         float reach_m,
                         std::size_t count,
                         std::vector<NearPoint>& found) const {
  found.clear();
  if (is_empty() || count == 0) return;
  std::vector<std::uint32_t> indices(count);
  std::vector<float> distances2(count);
  const std::size_t size =
      tree_->tree.knnSearch(p.data(), count, indices.data(), distances2.data());
  for (std::size_t i = 0; i < size && distances2[i] < reach_m * reach_m; ++i) {
    found.push_back({indices[i], std::sqrt(distances2[i])});
  }
}

}  // namespace atlas
