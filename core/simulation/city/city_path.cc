// Nodes and where they are.
#include "core/simulation/city/city_path.h"

#include <algorithm>
#include <cmath>

namespace atlas {
namespace {

// An earlier pass this near, at least so much earlier on the way, has built the street already.
constexpr double kSameStreet_m = 14.0;
constexpr double kEarlier_m = 40.0;

std::uint64_t KeyOf(const CityChunk& chunk) {
  return (std::uint64_t{static_cast<std::uint32_t>(chunk.x)} << 32) |
         static_cast<std::uint32_t>(chunk.y);
}

Eigen::Vector2d Plan(const CityNode& node) {
  return node.ground.head<2>();
}

}  // namespace

CityChunk CityChunk::At(const Eigen::Vector2d& p) {
  return {static_cast<std::int32_t>(std::floor(p.x() / kSize_m)),
          static_cast<std::int32_t>(std::floor(p.y() / kSize_m))};
}

Eigen::AlignedBox2d CityChunk::Square() const {
  const Eigen::Vector2d low(x * kSize_m, y * kSize_m);
  return {low, low + Eigen::Vector2d::Constant(kSize_m)};
}

CityPath::CityPath(std::span<const std::vector<Eigen::Vector3d>> legs, double sensor_height_m) {
  for (const std::vector<Eigen::Vector3d>& leg : legs) {
    AddLeg(leg, sensor_height_m);
  }
  Index();
  FindFirstPasses();
}

void CityPath::AddLeg(std::span<const Eigen::Vector3d> points, double sensor_height_m) {
  const std::uint32_t leg = nodes_.empty() ? 0 : nodes_.back().leg + 1;
  double along_m = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t before = i > 0 ? i - 1 : i;
    const std::size_t after = i + 1 < points.size() ? i + 1 : i;
    const Eigen::Vector3d ahead = points[after] - points[before];
    along_m += (points[i] - points[before]).head<2>().norm();
    const Eigen::Vector3d ground = points[i] - sensor_height_m * Eigen::Vector3d::UnitZ();
    nodes_.push_back({ground, std::atan2(ahead.y(), ahead.x()), along_m, leg, after == i, true});
  }
}

void CityPath::Index() {
  for (std::uint32_t i = 0; i < nodes_.size(); ++i) {
    by_chunk_[KeyOf(CityChunk::At(Plan(nodes_[i])))].push_back(i);
  }
}

void CityPath::FindFirstPasses() {
  for (std::uint32_t i = 0; i < nodes_.size(); ++i) {
    const Eigen::Vector2d p = Plan(nodes_[i]);
    const CityChunk home = CityChunk::At(p);
    const auto is_earlier_pass = [&](std::uint32_t other) {
      const CityNode& node = nodes_[other];
      const bool is_earlier =
          node.leg < nodes_[i].leg || node.along_m < nodes_[i].along_m - kEarlier_m;
      return other < i && is_earlier && (Plan(node) - p).norm() < kSameStreet_m;
    };
    for (int n = 0; n < 9 && nodes_[i].is_first_pass; ++n) {
      const auto near = NodesIn({home.x + n % 3 - 1, home.y + n / 3 - 1});
      nodes_[i].is_first_pass = std::none_of(near.begin(), near.end(), is_earlier_pass);
    }
  }
}

std::span<const std::uint32_t> CityPath::NodesIn(const CityChunk& chunk) const {
  const auto found = by_chunk_.find(KeyOf(chunk));
  return found == by_chunk_.end() ? std::span<const std::uint32_t>() : found->second;
}

std::vector<std::uint32_t> CityPath::NodesNear(const Eigen::AlignedBox2d& square) const {
  const Eigen::Vector2d reach = Eigen::Vector2d::Constant(kReach_m);
  const CityChunk low = CityChunk::At(square.min() - reach);
  const CityChunk high = CityChunk::At(square.max() + reach);
  std::vector<std::uint32_t> near;
  for (std::int32_t y = low.y; y <= high.y; ++y) {
    for (std::int32_t x = low.x; x <= high.x; ++x) {
      for (const std::uint32_t i : NodesIn({x, y})) {
        if (square.exteriorDistance(Plan(nodes_[i])) <= kReach_m) {
          near.push_back(i);
        }
      }
    }
  }
  return near;
}

}  // namespace atlas
