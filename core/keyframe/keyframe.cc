#include "core/keyframe/keyframe.h"

#include <algorithm>
#include <cstdlib>

#include "core/base/integer_math.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr std::int64_t kUnitSquared = std::int64_t{1} << 60;  // of a quaternion x 2^30

bool IsUnit(const std::array<std::int32_t, 4>& quaternion) {
  std::uint64_t squared = 0;
  for (const std::int32_t part : quaternion) {
    const std::int64_t value = part;
    squared += static_cast<std::uint64_t>(value * value);  // at most 4 * 2^62: fits
  }
  const auto unit = static_cast<std::uint64_t>(kUnitSquared);
  const std::uint64_t deviation = squared > unit ? squared - unit : unit - squared;
  return squared != 0 && deviation <= unit / 500'000;  // 1e-6 of the length
}

Status CheckCell(const Keyframe& keyframe, std::size_t index) {
  const KeyframeCell& cell = keyframe.cells[index];
  if (cell.occupancy > Occupancy::kDriven || cell.source > AltitudeSource::kExtrapolated) {
    return Status(StatusCode::kInvalidData,
                  StrCat("keyframe: cell ", index, " has an unknown occupancy or altitude source"));
  }
  if (cell.source == AltitudeSource::kNone &&
      (cell != KeyframeCell{} || keyframe.columns[index] != 0)) {
    return Status(StatusCode::kInvalidData,
                  StrCat("keyframe: cell ", index, " was not seen but holds values"));
  }
  return {};
}

}  // namespace

Status ValidateKeyframeFrame(const GridGeometry& grid,
                             const std::array<std::int32_t, 4>& level_quaternion,
                             std::int32_t sensor_height_mm) {
  if (grid.radius_cells < 1 || grid.radius_cells > Keyframe::kMaxRadiusCells) {
    return Status(StatusCode::kInvalidData,
                  StrCat("keyframe: radius is ", grid.radius_cells, " cells, expected 1 to ",
                         Keyframe::kMaxRadiusCells));
  }
  if (grid.cell_size_um < 20'000 || grid.cell_size_um > 1'000'000) {
    return Status(StatusCode::kInvalidData,
                  StrCat("keyframe: cell size is ", grid.cell_size_m(), " m, expected 0.02 to 1"));
  }
  if (!IsUnit(level_quaternion)) {
    return Status(StatusCode::kInvalidData, "keyframe: level quaternion's length is not 1");
  }
  if (sensor_height_mm < Keyframe::kMinSensorHeight_mm ||
      sensor_height_mm > Keyframe::kMaxSensorHeight_mm) {
    return Status(StatusCode::kInvalidData,
                  StrCat("keyframe: sensor height is ", sensor_height_mm, " mm, expected ",
                         Keyframe::kMinSensorHeight_mm, " to ", Keyframe::kMaxSensorHeight_mm));
  }
  return {};
}

Status ValidateKeyframe(const Keyframe& keyframe) {
  ATLAS_RETURN_IF_ERROR(
      ValidateKeyframeFrame(keyframe.grid, keyframe.level_quaternion, keyframe.sensor_height_mm));
  const std::size_t size = keyframe.grid.size();
  if (keyframe.cells.size() != size || keyframe.columns.size() != size ||
      keyframe.anchors.size() != keyframe.block_count()) {
    return Status(StatusCode::kInvalidData,
                  StrCat("keyframe: ", keyframe.cells.size(), " cells, ", keyframe.columns.size(),
                         " columns and ", keyframe.anchors.size(), " anchors, expected ", size,
                         ", ", size, " and ", keyframe.block_count()));
  }
  for (std::size_t i = 0; i < size; ++i) {
    ATLAS_RETURN_IF_ERROR(CheckCell(keyframe, i));
  }
  return {};
}

}  // namespace atlas
