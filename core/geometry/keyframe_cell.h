// What one scan says about the ground in one cell (paper III-B).
#pragma once

#include <cstdint>

namespace atlas {

// Frozen: 2 bits each in the keyframe blob.
enum class Occupancy : std::uint8_t {
  kUnknown = 0,
  kFree = 1,
  kObstacle = 2,
  kDriven = 3,  // the vehicle itself stands there
};
enum class AltitudeSource : std::uint8_t {
  kNone = 0,          // the cell was not seen
  kMeasured = 1,      // ground returns fell into it
  kInterpolated = 2,  // between ground returns along the ray
  kExtrapolated = 3,  // the nearest ground on the ray
};

struct KeyframeCell {
  std::int16_t altitude_mm = 0;  // ground, relative to the sensor, levelled frame
  Occupancy occupancy = Occupancy::kUnknown;
  AltitudeSource source = AltitudeSource::kNone;

  friend bool operator==(const KeyframeCell&, const KeyframeCell&) = default;
};

}  // namespace atlas
