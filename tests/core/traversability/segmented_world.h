// Scans of worlds whose truth is known, segmented, and how much of each surface was called ground.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "core/traversability/segmenter.h"
#include "tests/core/support/shape_world.h"

namespace atlas::testing {

inline constexpr double kHeight_m = 1.8;

// 16, 32 and 64 rings over about the same angles.
inline const std::array<SyntheticSensor, 3> kSensors{SyntheticSensor{Rings(16, -15.0, 2.0), 900},
                                                     SyntheticSensor{Rings(32, -24.8, 0.84), 900},
                                                     SyntheticSensor{Rings(64, -24.8, 0.42), 900}};

struct Score {
  int returns = 0;
  int ground = 0;  // of them, called ground

  double share() const { return returns == 0 ? 0.0 : static_cast<double>(ground) / returns; }
};

struct Segmented {
  RangeImage image;
  std::vector<std::uint8_t> is_ground;
  std::vector<Surface> truth;  // of each return of the image

  template <typename Filter>
  Score Count(Surface surface, const Filter& filter) const {
    Score score;
    for (std::size_t i = 0; i < image.size(); ++i) {
      const Eigen::Vector3f p(image.x[i], image.y[i], image.z[i]);
      if (truth[i] == surface && filter(p)) {
        ++score.returns;
        score.ground += is_ground[i];
      }
    }
    return score;
  }
  Score Count(Surface surface) const {
    return Count(surface, [](const Eigen::Vector3f&) { return true; });
  }
  Score CountWithin(Surface surface, float range_m) const {
    return Count(surface, [=](const Eigen::Vector3f& p) { return p.head<2>().norm() < range_m; });
  }
};

inline SensorLayout LayoutOf(const SyntheticSensor& sensor) {
  SensorLayout layout;
  for (const double elevation_deg : sensor.elevation_deg) {
    layout.elevation_rad.push_back(static_cast<float>(elevation_deg * kDegree));
  }
  return layout;
}

inline SegmenterOptions InMode(SegmentMode mode) {
  SegmenterOptions options;
  options.mode = mode;
  return options;
}

inline Segmented Segment(const SyntheticSensor& sensor,
                         const TruthScan& scan,
                         const Eigen::Vector3d& up_sensor = Eigen::Vector3d::UnitZ(),
                         SegmentMode mode = SegmentMode::kAtlas) {
  Segmented result;
  result.image = MakeRangeImage(scan.cloud, LayoutOf(sensor), 1);
  result.is_ground = Segmenter(InMode(mode)).Segment(result.image, up_sensor.cast<float>());
  EXPECT_EQ(result.is_ground.size(), result.image.size());
  for (const std::uint32_t source : result.image.source) {
    result.truth.push_back(scan.truth[source]);
  }
  return result;
}

inline Pose SensorAt(double z_m) {
  return UprightPose({0.0, 0.0, z_m}, 0.0);
}

inline ShapeWorld FlatWorld() {
  return {{Patch{}}, {}};
}

}  // namespace atlas::testing
