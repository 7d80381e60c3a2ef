// Nearest points of a cloud: a k-d tree over points that stay as they are.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace atlas {

struct NearPoint {
  std::uint32_t index = 0;  // into points()
  float distance_m = 0.0F;
};

class PointIndex {
 public:
  // Metres, in a frame whose origin is near: floats are exact enough.
  explicit PointIndex(std::vector<Eigen::Vector3f> points);
  PointIndex(const PointIndex&) = delete;
  PointIndex& operator=(const PointIndex&) = delete;
  PointIndex(PointIndex&&) noexcept;
  PointIndex& operator=(PointIndex&&) noexcept;
  ~PointIndex();

  const std::vector<Eigen::Vector3f>& points() const;
  bool is_empty() const { return points().empty(); }

  // The nearest point that is less than `reach_m` away.
  std::optional<NearPoint> Nearest(const Eigen::Vector3f& p, float reach_m) const;
  // Up to `count` of them, nearest first; replaces what `found` held.
  void Nearest(const Eigen::Vector3f& p,
               float reach_m,
               std::size_t count,
               std::vector<NearPoint>& found) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace atlas
