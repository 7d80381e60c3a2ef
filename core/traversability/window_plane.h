// The plane that most returns of one window lie in, without random numbers.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace atlas {

// Returns of up to three rings, ring after ring, as contiguous planes padded for vector loops.
struct WindowReturns {
  std::vector<float> x, y, z;
  std::array<std::uint32_t, 4>
      ring_begin{};  // returns of ring r: [ring_begin[r], ring_begin[r + 1])

  std::uint32_t size() const { return ring_begin[3]; }
  Eigen::Vector3f Point(std::uint32_t i) const { return {x[i], y[i], z[i]}; }
  int FilledRings() const;
};

// dot(normal, p) + offset = 0, normal of unit length.
struct Plane {
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();
  float offset_m = 0.0F;
};

struct WindowPlane {
  Plane plane;
  std::uint32_t inliers = 0;
};

enum class TripleChoice : std::uint8_t {
  kAnywhere,    // like RANSAC: three returns of one ring make poor planes
  kOneInARing,  // spread over the rings
};

struct PlaneFitOptions {
  float threshold_m = 0.0F;  // distance of an inlier
  TripleChoice choice = TripleChoice::kOneInARing;
  float min_inlier_ratio = 0.0F;  // of the window's returns
};

// Best of a fixed table of 32 triples; nullopt when every triple is degenerate or has too few
// inliers. Requires at least one return, and infinite padding beyond size(): it must lie on no
// plane.
std::optional<WindowPlane> FitPlane(const WindowReturns& window, const PlaneFitOptions& options);

}  // namespace atlas
