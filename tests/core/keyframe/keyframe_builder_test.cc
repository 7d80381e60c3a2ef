// The front end in small worlds: flat ground, a kerb, a wall, a ceiling, a ramp.
#include "core/keyframe/keyframe_builder.h"

#include <array>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/geometry/nibble.h"
#include "core/keyframe/keyframe_codec.h"
#include "tests/core/support/shape_world.h"
#include "tests/core/support/synthetic_scan.h"

namespace atlas {
namespace {

using testing::GroundRange;
using testing::Nearest;
using testing::Scan;
using testing::Vlp16;

constexpr double kHeight_m = 1.8;

// A wall across the road, `x_m` ahead.
std::optional<double> WallAhead(const Eigen::Vector3d& direction, double x_m) {
  return direction.x() > 1e-6 ? std::optional<double>(x_m / direction.x()) : std::nullopt;
}

class KeyframeBuilderTest : public ::testing::Test {
 protected:
  Keyframe Build(const testing::World& world,
                 const Eigen::Quaterniond& R_level_sensor = Eigen::Quaterniond::Identity(),
                 std::span<const VehiclePlace> trail = {},
                 double yaw_rad = 0.0) {
    const PointCloud cloud = Scan(Vlp16(), world);
    SensorLayoutEstimator estimator;
    estimator.Add(cloud);
    KeyframeBuilderOptions options;
    options.mount.height_m = kHeight_m;
    const KeyframeBuilder builder(profile_, *estimator.Estimate(), options);
    Keyframe keyframe = builder.Build(cloud, {R_level_sensor, yaw_rad}, trail);
    EXPECT_TRUE(ValidateKeyframe(keyframe).ok());
    const Result<Keyframe> decoded = DecodeKeyframe(EncodeKeyframe(keyframe));
    EXPECT_TRUE(decoded.has_value() && *decoded == keyframe);
    return keyframe;
  }

  static std::size_t CellAt(const Keyframe& keyframe, double x_m, double y_m) {
    return keyframe.grid.Index(static_cast<std::int32_t>(std::floor(x_m / 0.1)),
                               static_cast<std::int32_t>(std::floor(y_m / 0.1)));
  }

  // State of the column's segment at height `z_m` (levelled frame) of the cell at (x, y).
  std::uint8_t Segment(const Keyframe& keyframe, double x_m, double y_m, double z_m) const {
    const auto ix = static_cast<std::int32_t>(std::floor(x_m / 0.1));
    const auto iy = static_cast<std::int32_t>(std::floor(y_m / 0.1));
    const int segment = static_cast<int>(std::floor(z_m / profile_.segment_height_m())) -
                        keyframe.anchors[keyframe.BlockIndex(ix, iy)];
    EXPECT_GE(segment, 0);
    EXPECT_LT(segment, profile_.column_segments);
    return NibbleAt(keyframe.columns[keyframe.grid.Index(ix, iy)], segment);
  }

  MapProfile profile_;
};

TEST_F(KeyframeBuilderTest, FlatGroundIsFreeAndAtTheSensorsHeight) {
  const Keyframe keyframe =
      Build([](const Eigen::Vector3d& d) { return GroundRange(d, kHeight_m); });
  for (double r = 1.0; r < 14.5; r += 0.9) {  // the ring at -7 degrees ends at 14.7 m
    for (int k = 0; k < 24; ++k) {
      const KeyframeCell& cell =
          keyframe.cells[CellAt(keyframe, r * std::cos(k * 0.26), r * std::sin(k * 0.26))];
      const bool is_below_vehicle =
          std::abs(r * std::cos(k * 0.26)) < 1.5 && std::abs(r * std::sin(k * 0.26)) < 1.1;
      EXPECT_EQ(cell.occupancy, is_below_vehicle ? Occupancy::kDriven : Occupancy::kFree)
          << r << " " << k;
      EXPECT_NEAR(cell.altitude_mm, -1800, 15) << r << " " << k;
    }
  }
}

TEST_F(KeyframeBuilderTest, AWallEndsTheGroundAndRaisesColumns) {
  const Keyframe keyframe = Build([](const Eigen::Vector3d& d) {
    return Nearest(GroundRange(d, kHeight_m), WallAhead(d, 10.05));
  });
  EXPECT_EQ(keyframe.cells[CellAt(keyframe, 9.0, 0.05)].occupancy, Occupancy::kFree);
  EXPECT_EQ(keyframe.cells[CellAt(keyframe, 10.05, 0.05)].occupancy, Occupancy::kObstacle);
  EXPECT_EQ(keyframe.cells[CellAt(keyframe, 11.0, 0.05)].occupancy, Occupancy::kUnknown);
  EXPECT_NEAR(keyframe.cells[CellAt(keyframe, 10.05, 0.05)].altitude_mm, -1800, 50);
  EXPECT_EQ(Segment(keyframe, 10.05, 0.05, 0.5), kNibbleHit);
  EXPECT_EQ(Segment(keyframe, 10.05, 0.05, -0.5), kNibbleHit);
  EXPECT_EQ(Segment(keyframe, 6.05, 0.05, 0.5), kNibbleMiss);
  EXPECT_EQ(Segment(keyframe, 11.05, 0.05, 0.5), 0);  // nothing is known behind it
}

TEST_F(KeyframeBuilderTest, ACeilingIsNoGroundAndStopsNoVehicle) {
  const Keyframe keyframe = Build([](const Eigen::Vector3d& d) {
    const std::optional<double> ceiling =
        d.z() > 0.0 ? std::optional<double>(1.2 / d.z()) : std::nullopt;
    return Nearest(GroundRange(d, kHeight_m), ceiling);
  });
  for (double x = 3.0; x < 14.5; x += 0.5) {
    const KeyframeCell& cell = keyframe.cells[CellAt(keyframe, x, 0.05)];
    EXPECT_EQ(cell.occupancy, Occupancy::kFree) << x;
    EXPECT_LT(cell.altitude_mm, -1700) << x;
  }
}

TEST_F(KeyframeBuilderTest, ATurnedGridShowsTheSame) {
  // A wall 6 m ahead of a pitched vehicle that came along a bend.
  const Eigen::Quaterniond pitch(
      Eigen::AngleAxisd(3.0 * testing::kDegree, Eigen::Vector3d::UnitY()));
  const auto world = [&](const Eigen::Vector3d& d) {
    const Eigen::Vector3d level = pitch * d;
    return Nearest(GroundRange(level, kHeight_m), WallAhead(level, 6.05));
  };
  VehiclePlace before;
  before.sensor_m = Eigen::Vector3f(-3.0F, 0.5F, 0.0F);
  before.ahead = Eigen::Vector2f(1.0F, -0.2F).normalized();
  const std::vector<VehiclePlace> trail{before};
  const Keyframe straight = Build(world, pitch, trail);
  for (const double yaw_rad : {0.3, 1.2}) {
    const Keyframe turned = Build(world, pitch, trail, yaw_rad);
    const auto cell = [&](double x_m, double y_m) {
      const Eigen::Vector2d p = Eigen::Rotation2Dd(-yaw_rad) * Eigen::Vector2d(x_m, y_m);
      return CellAt(turned, p.x(), p.y());
    };
    std::size_t same = 0;
    std::size_t seen = 0;
    for (double y_m = -5.95; y_m < 6.0; y_m += 0.1) {
      for (double x_m = -7.95; x_m < 8.0; x_m += 0.1) {
        const KeyframeCell& of_straight = straight.cells[CellAt(straight, x_m, y_m)];
        const KeyframeCell& of_turned = turned.cells[cell(x_m, y_m)];
        same += of_straight.occupancy == of_turned.occupancy ? 1U : 0U;
        ++seen;
      }
    }
    EXPECT_GT(static_cast<double>(same), 0.93 * static_cast<double>(seen)) << yaw_rad;
    for (const auto& [x_m, y_m] : {std::pair(1.3, 0.9), {-1.3, -0.9}, {-4.2, 0.9}, {-3.9, 1.5}}) {
      EXPECT_EQ(turned.cells[cell(x_m, y_m)].occupancy, Occupancy::kDriven) << x_m << ' ' << y_m;
    }
    for (const auto& [x_m, y_m] : {std::pair(0.9, 1.4), {1.7, 0.0}, {-3.0, -0.8}, {-4.7, 0.5}}) {
      EXPECT_NE(turned.cells[cell(x_m, y_m)].occupancy, Occupancy::kDriven) << x_m << ' ' << y_m;
    }
    // From the sensor to the grid, both about the same vertical.
    const auto& q = turned.level_quaternion;
    const Eigen::Quaterniond R_grid_sensor =
        Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized();
    const Eigen::Quaterniond R_grid_level = R_grid_sensor * pitch.conjugate();
    EXPECT_NEAR(R_grid_level.angularDistance(
                    Eigen::Quaterniond(Eigen::AngleAxisd(-yaw_rad, Eigen::Vector3d::UnitZ()))),
                0.0, 1e-6);
  }
}

TEST(GridYawTest, GridsStandEvenlyInAllDirections) {
  for (const std::uint64_t first : {std::uint64_t{0}, std::uint64_t{1'000'003}}) {
    std::array<int, 9> in_ten_deg{};
    for (std::uint64_t sequence = first; sequence < first + 90; ++sequence) {
      const double yaw_deg = GridYaw(sequence) / testing::kDegree;
      ASSERT_GE(yaw_deg, 0.0);
      ASSERT_LT(yaw_deg, 90.0);
      ++in_ten_deg[static_cast<std::size_t>(yaw_deg / 10.0)];
    }
    for (const int count : in_ten_deg) {
      EXPECT_NEAR(count, 10, 1);
    }
  }
}

TEST_F(KeyframeBuilderTest, ATiltedVehicleStandsOnATiltedPlane) {
  // Level ground, the sensor pitched by 10 degrees: the levelled frame shows flat ground again, but
  // below the vehicle itself the plane of its wheels.
  const Eigen::Quaterniond pitch(
      Eigen::AngleAxisd(10.0 * testing::kDegree, Eigen::Vector3d::UnitY()));
  const Keyframe keyframe =
      Build([&](const Eigen::Vector3d& d) { return GroundRange(pitch * d, kHeight_m); }, pitch);
  const KeyframeCell& far = keyframe.cells[CellAt(keyframe, 12.0, 0.05)];
  EXPECT_NEAR(far.altitude_mm, -1800, 30);
  const KeyframeCell& below = keyframe.cells[CellAt(keyframe, 1.0, 0.05)];
  EXPECT_NEAR(below.altitude_mm, -1800 - 1000.0 * 1.05 * std::tan(10.0 * testing::kDegree), 40);
}

TEST_F(KeyframeBuilderTest, AScanWithoutReturnsSeesNothingButItsOwnPlace) {
  KeyframeBuilderOptions options;
  const KeyframeBuilder builder(profile_, SensorLayout{EgoBox(), std::vector<float>(16, 0.0F)},
                                options);
  const Keyframe keyframe = builder.Build(PointCloud(), {});
  EXPECT_TRUE(ValidateKeyframe(keyframe).ok());
  for (const KeyframeCell& cell : keyframe.cells) {
    EXPECT_NE(cell.occupancy, Occupancy::kObstacle);
  }
}

TEST_F(KeyframeBuilderTest, OptionsOutOfRangeAreNamed) {
  KeyframeBuilderOptions options;
  EXPECT_TRUE(options.Validate(profile_).ok());
  options.max_range_m = 0.5;
  EXPECT_EQ(options.Validate(profile_).code(), StatusCode::kInvalidArgument);
  options.max_range_m = 20.0;
  options.mount.height_m = std::nan("");
  EXPECT_EQ(options.Validate(profile_).code(), StatusCode::kInvalidArgument);
}

TEST_F(KeyframeBuilderTest, WhatItJustDroveIsFreeWhateverFollowsIt) {
  // Up a ramp of 0.1 to the flat where it is now; something stands 3 m behind it.
  const auto world = [](const Eigen::Vector3d& d) {
    const auto behind = d.x() < -1e-6 ? std::optional<double>(-3.05 / d.x()) : std::nullopt;
    return Nearest(GroundRange(d, kHeight_m), behind);
  };
  std::vector<VehiclePlace> trail;
  for (float x_m = -0.5F; x_m >= -5.0F; x_m -= 0.5F) {
    VehiclePlace place;
    place.sensor_m = Eigen::Vector3f(x_m, 0.0F, 0.1F * x_m);
    place.normal = Eigen::Vector3f(-0.1F, 0.0F, 1.0F).normalized();
    trail.push_back(place);
  }
  const Keyframe without = Build(world);
  const Keyframe with = Build(world, Eigen::Quaterniond::Identity(), trail);
  EXPECT_EQ(without.cells[CellAt(without, -3.05, 0.55)].occupancy, Occupancy::kObstacle);
  EXPECT_EQ(Segment(without, -3.05, 0.55, -0.5), kNibbleHit);
  for (const double x_m : {-1.95, -3.05, -4.55, -6.35}) {
    for (const double y_m : {-1.05, 0.05, 1.05}) {
      const KeyframeCell& cell = with.cells[CellAt(with, x_m, y_m)];
      EXPECT_EQ(cell.occupancy, Occupancy::kDriven) << x_m << ' ' << y_m;
      EXPECT_EQ(cell.source, AltitudeSource::kMeasured);
      EXPECT_NEAR(cell.altitude_mm, 1e3 * (0.1 * x_m - kHeight_m), 2.0) << x_m << ' ' << y_m;
      EXPECT_EQ(Segment(with, x_m, y_m, -1.5), kNibbleFree);
      // Its top was above the sensor of now, or where it stood lower in the segment below it.
      EXPECT_EQ(Segment(with, x_m, y_m, -0.5), x_m > -4.5 ? kNibbleFree : kNibbleOver) << x_m;
    }
    EXPECT_NE(with.cells[CellAt(with, x_m, 1.25)].occupancy, Occupancy::kDriven);
  }
  EXPECT_NE(with.cells[CellAt(with, -6.65, 0.05)].occupancy, Occupancy::kDriven);
}

}  // namespace
}  // namespace atlas
