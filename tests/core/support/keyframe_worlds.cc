#include "tests/core/support/keyframe_worlds.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>

#include "core/geometry/nibble.h"

namespace atlas::testing {
namespace {

template <typename Visit>
void VisitDisc(const GridGeometry& grid, const Visit& visit) {
  const std::int32_t r = grid.radius_cells;
  for (std::int32_t iy = -r; iy < r; ++iy) {
    for (std::int32_t ix = -r; ix < r; ++ix) {
      if ((2 * ix + 1) * (2 * ix + 1) + (2 * iy + 1) * (2 * iy + 1) < 4 * r * r) {
        visit(ix, iy, grid.Index(ix, iy));
      }
    }
  }
}

std::uint64_t SegmentMask(const MapProfile& profile) {
  return ~std::uint64_t{0} >> (64u - 4u * profile.column_segments);
}

// A wall every 12 m across the y axis, 0.3 m thick.
bool IsWall(double y_m) {
  return std::abs(y_m) > 7.0 && std::fmod(std::abs(y_m), 12.0) < 0.3;
}

std::uint64_t StreetColumn(bool is_wall, std::mt19937& random) {
  if (is_wall) {
    return 0x0CCCCCCCu;
  }
  const std::uint32_t draw = random() % 8;
  return draw < 3 ? 0 : 0x66666666u >> (4 * (draw % 7));
}

}  // namespace

Keyframe BlankKeyframe(const MapProfile& profile, std::int32_t radius_cells) {
  Keyframe keyframe;
  keyframe.profile_hash = profile.Hash();
  keyframe.grid = {profile.cell_size_um, radius_cells};
  keyframe.sensor_height_mm = 1'730;
  keyframe.cells.resize(keyframe.grid.size());
  keyframe.columns.resize(keyframe.grid.size());
  keyframe.anchors.resize(keyframe.block_count());
  return keyframe;
}

void FillDisc(Keyframe& keyframe, const KeyframeCell& cell, std::uint64_t column) {
  VisitDisc(keyframe.grid, [&](std::int32_t, std::int32_t, std::size_t index) {
    keyframe.cells[index] = cell;
    keyframe.columns[index] = column;
  });
}

Keyframe RandomKeyframe(const MapProfile& profile, std::int32_t radius_cells, std::uint32_t seed) {
  std::mt19937 random(seed);
  Keyframe keyframe = BlankKeyframe(profile, radius_cells);
  keyframe.sensor_height_mm =
      std::max(Keyframe::kMinSensorHeight_mm, static_cast<std::int32_t>(random() % 3'000));
  for (std::size_t i = 0; i < keyframe.cells.size(); ++i) {
    KeyframeCell& cell = keyframe.cells[i];
    cell.source = static_cast<AltitudeSource>(random() % 4);
    if (cell.source == AltitudeSource::kNone) {
      continue;
    }
    cell.occupancy = static_cast<Occupancy>(random() % 4);
    cell.altitude_mm = static_cast<std::int16_t>(random());
    const std::uint64_t bits = (std::uint64_t{random()} << 32) | random();
    keyframe.columns[i] = random() % 3 == 0 ? bits & SegmentMask(profile) : 0;
  }
  for (std::int16_t& anchor : keyframe.anchors) {
    anchor = static_cast<std::int16_t>(random() % 9);
    anchor = static_cast<std::int16_t>(anchor - 4);
  }
  return keyframe;
}

Keyframe StreetKeyframe(const MapProfile& profile, std::int32_t radius_cells, std::uint32_t seed) {
  std::mt19937 random(seed);
  Keyframe keyframe = BlankKeyframe(profile, radius_cells);
  VisitDisc(keyframe.grid, [&](std::int32_t ix, std::int32_t iy, std::size_t index) {
    if (random() % 16 == 0) {
      return;
    }
    const double x_m = ix * profile.cell_size_m();
    const double y_m = iy * profile.cell_size_m();
    const bool is_wall = IsWall(y_m);
    KeyframeCell& cell = keyframe.cells[index];
    cell.altitude_mm =
        static_cast<std::int16_t>(-1'730 + 10.0 * x_m + static_cast<double>(random() % 21));
    cell.occupancy = is_wall ? Occupancy::kObstacle : Occupancy::kFree;
    const bool is_measured = random() % 4 == 0;
    cell.source = is_wall       ? AltitudeSource::kExtrapolated
                  : is_measured ? AltitudeSource::kMeasured
                                : AltitudeSource::kInterpolated;
    keyframe.columns[index] = StreetColumn(is_wall, random) & SegmentMask(profile);
  });
  for (std::int16_t& anchor : keyframe.anchors) {
    anchor = -2;
  }
  return keyframe;
}

KeyframePlacement PlaceAt(const MapPose& pose) {
  Pose T_world_sensor = Pose::Identity();
  T_world_sensor.translation() = Eigen::Vector3d(pose.x_m, pose.y_m, pose.z_m);
  T_world_sensor.linear() =
      Eigen::AngleAxisd(pose.yaw_deg * 3.14159265358979323846 / 180.0, Eigen::Vector3d::UnitZ())
          .toRotationMatrix();
  constexpr std::array<std::int32_t, 4> kLevel{1 << QuantizedPose::kQuaternionBits, 0, 0, 0};
  return PlaceKeyframe(QuantizedPose::FromPose(T_world_sensor), kLevel).value();
}

PlacedKeyframe PlacedFrame(const FrameName& name, const MapPose& pose, Keyframe keyframe) {
  PlacedKeyframe placed;
  placed.key = {{name.vehicle, name.session}, name.sequence};
  placed.time_ms = std::int64_t{100} * name.sequence;
  placed.placement = PlaceAt(pose);
  placed.keyframe = std::make_shared<const Keyframe>(std::move(keyframe));
  return placed;
}

}  // namespace atlas::testing
