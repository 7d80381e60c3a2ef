#include "core/traversability/window_plane.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "core/base/vector_clones.h"

namespace atlas {
namespace {

constexpr int kTriples = 32;
constexpr std::size_t kLanes = 16;

// Where in its ring (or in the window) each corner of a triple lies, 0..1: the additive recurrence
// of the golden ratio and its relatives fills the unit cube evenly.
struct Triple {
  std::array<float, 3> at;
};

constexpr std::array<Triple, kTriples> MakeTriples() {
  constexpr std::array<double, 3> kSteps = {0.8191725133961645, 0.6710436067037893,
                                            0.5497004779019703};
  std::array<Triple, kTriples> triples{};
  std::array<double, 3> at = {0.5, 0.5, 0.5};
  for (Triple& triple : triples) {
    for (std::size_t k = 0; k < 3; ++k) {
      at[k] += kSteps[k];
      at[k] -= at[k] >= 1.0 ? 1.0 : 0.0;
      triple.at[k] = static_cast<float>(at[k]);
    }
  }
  return triples;
}

constexpr std::array<Triple, kTriples> kTable = MakeTriples();

// Corner `k` of a triple: in ring k, or in a neighbouring ring when that one is empty.
std::uint32_t Corner(const WindowReturns& window, std::size_t k, float at) {
  std::size_t ring = k;
  while (window.ring_begin[ring] == window.ring_begin[ring + 1]) {
    ring = (ring + 1) % 3;
  }
  const std::uint32_t begin = window.ring_begin[ring];
  const std::uint32_t size = window.ring_begin[ring + 1] - begin;
  return begin + static_cast<std::uint32_t>(at * static_cast<float>(size));
}

std::optional<Plane> ThroughPoints(const Eigen::Vector3f& a,
                                   const Eigen::Vector3f& b,
                                   const Eigen::Vector3f& c) {
  const Eigen::Vector3f normal = (b - a).cross(c - a);
  const float length = normal.norm();
  const float scale = (b - a).squaredNorm() + (c - a).squaredNorm();
  if (length <= 1e-3F * scale) {
    return std::nullopt;  // on a line
  }
  return Plane{normal / length, -normal.dot(a) / length};
}

// Whole vectors: the padding is far from every plane. Gives up, with fewer than `least`, as soon as
// that many cannot be reached any more.
ATLAS_VECTOR_CLONES
std::uint32_t CountInliers(const WindowReturns& window,
                           const Plane& plane,
                           float threshold_m,
                           std::uint32_t least) {
  constexpr std::size_t kBlock = 4 * kLanes;
  const float nx = plane.normal.x();
  const float ny = plane.normal.y();
  const float nz = plane.normal.z();
  const float* x = window.x.data();
  const float* y = window.y.data();
  const float* z = window.z.data();
  const std::size_t size = window.size();
  std::uint32_t total = 0;
  // Indices of pointers' width: narrower ones may wrap, and each lane is then loaded by itself.
  for (std::size_t block = 0; block < size; block += kBlock) {
    const std::size_t end = std::min(block + kBlock, size);
    std::array<std::int32_t, kLanes> count{};
    for (std::size_t i = block; i < end; i += kLanes) {
      for (std::size_t k = 0; k < kLanes; ++k) {
        const float distance = nx * x[i + k] + ny * y[i + k] + nz * z[i + k] + plane.offset_m;
        count[k] += static_cast<std::int32_t>(std::abs(distance) < threshold_m);
      }
    }
    for (const std::int32_t lane : count) {
      total += static_cast<std::uint32_t>(lane);
    }
    if (total + size - end < least) {
      break;
    }
  }
  return total;
}

}  // namespace

int WindowReturns::FilledRings() const {
  int filled = 0;
  for (std::size_t ring = 0; ring < 3; ++ring) {
    filled += ring_begin[ring + 1] > ring_begin[ring] ? 1 : 0;
  }
  return filled;
}

std::optional<WindowPlane> FitPlane(const WindowReturns& window, const PlaneFitOptions& options) {
  const auto corner = [&](const Triple& triple, std::size_t k) {
    const std::uint32_t i =
        options.choice == TripleChoice::kOneInARing
            ? Corner(window, k, triple.at[k])
            : static_cast<std::uint32_t>(triple.at[k] * static_cast<float>(window.size()));
    return window.Point(i);
  };
  const float enough = options.min_inlier_ratio * static_cast<float>(window.size());
  auto least = static_cast<std::uint32_t>(std::ceil(enough));
  std::optional<WindowPlane> best;
  for (const Triple& triple : kTable) {
    const auto plane = ThroughPoints(corner(triple, 0), corner(triple, 1), corner(triple, 2));
    if (!plane) {
      continue;
    }
    const std::uint32_t inliers = CountInliers(window, *plane, options.threshold_m, least);
    if (inliers >= least) {
      best = WindowPlane{*plane, inliers};
      least = inliers + 1;
    }
    if (inliers == window.size()) {
      break;  // no later triple can have more: most windows of a road end here
    }
  }
  return best;
}

}  // namespace atlas
