// Building (binned SAH, Wald 2007) and walking the hierarchy.
#include "core/simulation/mesh/mesh_bvh.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <span>

namespace atlas {
namespace {

constexpr std::size_t kBins = 16;
constexpr std::uint32_t kLeafTriangles = 4;
// Triangle ranges halve at the latest once depth passes this, so that stacks stay bounded.
constexpr int kMaxSahDepth = 40;
constexpr std::size_t kStackSize = 96;

struct Box {
  Eigen::Vector3f low = Eigen::Vector3f::Constant(std::numeric_limits<float>::infinity());
  Eigen::Vector3f high = Eigen::Vector3f::Constant(-std::numeric_limits<float>::infinity());

  void Add(const Eigen::Vector3f& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  void Add(const Box& box) {
    low = low.cwiseMin(box.low);
    high = high.cwiseMax(box.high);
  }
  float HalfArea() const {
    const Eigen::Vector3f d = (high - low).cwiseMax(0.0F);
    return d.x() * d.y() + d.y() * d.z() + d.z() * d.x();
  }
};

struct Bin {
  Box box;
  std::uint32_t count = 0;
};

struct Split {
  int axis = 0;
  float position = 0.0F;
  float cost = std::numeric_limits<float>::infinity();
};

// Distance at which the ray enters the box, or infinity when it misses it before `max_m`.
inline float EnterBox(const Eigen::Vector3f& low,
                      const Eigen::Vector3f& high,
                      const Eigen::Vector3f& origin,
                      const Eigen::Vector3f& inverse,
                      float max_m) {
  const Eigen::Vector3f a = (low - origin).cwiseProduct(inverse);
  const Eigen::Vector3f b = (high - origin).cwiseProduct(inverse);
  const float enter =
      std::max({std::min(a.x(), b.x()), std::min(a.y(), b.y()), std::min(a.z(), b.z()), 0.0F});
  const float leave =
      std::min({std::max(a.x(), b.x()), std::max(a.y(), b.y()), std::max(a.z(), b.z()), max_m});
  return enter <= leave ? enter : std::numeric_limits<float>::infinity();
}

// 1 / x, huge but finite for zero: 0 * inverse stays a number.
float SafeInverse(float x) {
  constexpr float kTiny = 1e-12F;
  return 1.0F / (std::abs(x) < kTiny ? std::copysign(kTiny, x) : x);
}

}  // namespace

struct MeshBvh::Build {
  const TriangleMesh& mesh;
  MeshBvh& bvh;
  std::vector<Box> boxes;
  std::vector<Eigen::Vector3f> centres;

  void Run() {
    const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
    Measure(count);
    bvh.index_.resize(count);
    std::iota(bvh.index_.begin(), bvh.index_.end(), 0U);
    bvh.nodes_.emplace_back();
    Divide(0, 0, count, 0);
    bvh.triangles_.reserve(count);
    for (const std::uint32_t triangle : bvh.index_) {
      bvh.triangles_.push_back(EdgesOf(mesh, triangle));
    }
  }

  void Measure(std::uint32_t count) {
    boxes.resize(count);
    centres.resize(count);
    for (std::uint32_t i = 0; i < count; ++i) {
      for (const std::uint32_t vertex : mesh.triangles[i]) {
        boxes[i].Add(mesh.vertices[vertex]);
      }
      centres[i] = 0.5F * (boxes[i].low + boxes[i].high);
    }
  }

  std::span<std::uint32_t> Range(std::uint32_t begin, std::uint32_t end) {
    return std::span(bvh.index_).subspan(begin, end - begin);
  }

  void Divide(std::size_t node, std::uint32_t begin, std::uint32_t end, int depth) {
    Box box;
    Box centre_box;
    for (const std::uint32_t i : Range(begin, end)) {
      box.Add(boxes[i]);
      centre_box.Add(centres[i]);
    }
    // A hair wider: rounding in EnterBox must not cut off what lies in a face.
    bvh.nodes_[node].low = box.low.array() - 1e-4F;
    bvh.nodes_[node].high = box.high.array() + 1e-4F;
    if (end - begin <= kLeafTriangles) {
      bvh.nodes_[node].first = begin;
      bvh.nodes_[node].count = end - begin;
      return;
    }
    const std::uint32_t middle = Partition(begin, end, centre_box, depth);
    const std::size_t left = bvh.nodes_.size();
    bvh.nodes_[node].first = static_cast<std::uint32_t>(left);
    bvh.nodes_.resize(left + 2);
    Divide(left, begin, middle, depth + 1);
    Divide(left + 1, middle, end, depth + 1);
  }

  std::uint32_t Partition(std::uint32_t begin,
                          std::uint32_t end,
                          const Box& centre_box,
                          int depth) {
    const auto range = Range(begin, end);
    if (depth < kMaxSahDepth) {
      const Split split = BestSplit(range, centre_box);
      const auto middle = std::partition(range.begin(), range.end(), [&](std::uint32_t i) {
        return centres[i][split.axis] < split.position;
      });
      if (middle != range.begin() && middle != range.end()) {
        return begin + static_cast<std::uint32_t>(middle - range.begin());
      }
    }
    return begin + (end - begin) / 2;
  }

  Split BestSplit(std::span<const std::uint32_t> range, const Box& centre_box) const {
    Split best;
    for (int axis = 0; axis < 3; ++axis) {
      const float low = centre_box.low[axis];
      const float width = centre_box.high[axis] - low;
      if (width <= 0.0F) {
        continue;
      }
      std::array<Bin, kBins> bins;
      for (const std::uint32_t i : range) {
        const auto bin = static_cast<std::size_t>((centres[i][axis] - low) / width * kBins);
        Bin& b = bins[std::min(bin, kBins - 1)];
        b.box.Add(boxes[i]);
        ++b.count;
      }
      SweepBins(bins, axis, low, width, best);
    }
    return best;
  }

  static void SweepBins(
      const std::array<Bin, kBins>& bins, int axis, float low, float width, Split& best) {
    std::array<float, kBins> right_cost{};
    Bin right;
    for (std::size_t b = kBins - 1; b > 0; --b) {
      right.box.Add(bins[b].box);
      right.count += bins[b].count;
      right_cost[b] =
          right.count == 0 ? 0.0F : right.box.HalfArea() * static_cast<float>(right.count);
    }
    Bin left;
    for (std::size_t b = 1; b < kBins; ++b) {
      left.box.Add(bins[b - 1].box);
      left.count += bins[b - 1].count;
      const float left_cost =
          left.count == 0 ? 0.0F : left.box.HalfArea() * static_cast<float>(left.count);
      const float cost = left_cost + right_cost[b];
      if (cost < best.cost) {
        best = {axis, low + width * static_cast<float>(b) / kBins, cost};
      }
    }
  }
};

MeshBvh::MeshBvh(const TriangleMesh& mesh) {
  if (!mesh.triangles.empty()) {
    Build{mesh, *this, {}, {}}.Run();
  }
}

void MeshBvh::CastLeaf(const Node& leaf, const MeshRay& ray, MeshHit& nearest) const {
  for (std::uint32_t i = leaf.first; i < leaf.first + leaf.count; ++i) {
    const float distance_m = IntersectTriangle(ray, triangles_[i]);
    if (distance_m < nearest.distance_m) {
      nearest = {distance_m, index_[i]};
    }
  }
}

MeshHit MeshBvh::Cast(const MeshRay& ray, float max_distance_m) const {
  MeshHit nearest{max_distance_m, MeshHit::kNone};
  if (nodes_.empty()) {
    return nearest;
  }
  const Eigen::Vector3f inverse(SafeInverse(ray.direction.x()), SafeInverse(ray.direction.y()),
                                SafeInverse(ray.direction.z()));
  struct Entry {
    std::uint32_t node = 0;
    float enter_m = 0.0F;
  };
  std::array<Entry, kStackSize> stack{};
  std::size_t size = 0;
  stack[size++] = {0, 0.0F};
  while (size > 0) {
    const Entry entry = stack[--size];
    if (entry.enter_m >= nearest.distance_m) {
      continue;
    }
    const Node& node = nodes_[entry.node];
    if (node.count > 0) {
      CastLeaf(node, ray, nearest);
      continue;
    }
    const Node& left = nodes_[node.first];
    const Node& right = nodes_[node.first + 1];
    Entry near{node.first, EnterBox(left.low, left.high, ray.origin, inverse, nearest.distance_m)};
    Entry far{node.first + 1,
              EnterBox(right.low, right.high, ray.origin, inverse, nearest.distance_m)};
    if (far.enter_m < near.enter_m) {
      std::swap(near, far);
    }
    if (far.enter_m < nearest.distance_m) {
      stack[size++] = far;
    }
    if (near.enter_m < nearest.distance_m) {
      stack[size++] = near;
    }
  }
  return nearest;
}

}  // namespace atlas
