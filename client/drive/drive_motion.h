// How the sensor of a recorded drive moves during a scan, by the drive's own poses.
#pragma once

#include <cstddef>
#include <optional>

#include "core/geometry/pose.h"
#include "core/scan/drive_folder.h"

namespace atlas {

class DriveMotion {
 public:
  // The drive outlives this. `revolution_s` of the sensor; none: as long as two scans are apart as
  // a rule.
  explicit DriveMotion(const DriveFolder& drive, std::optional<double> revolution_s = std::nullopt);

  // T_now_later from scan `index` to the one numbered next, or to it from the one before; a jump is
  // no motion, nor is a gap in the numbers where no times tell how long it is. Where times say that
  // the two are further apart, in one revolution of the sensor.
  // Identity, as for a sensor that stands, where it has no neighbour.
  Pose During(std::size_t index) const;

 private:
  std::optional<Pose> Between(std::size_t from, std::size_t to) const;

  const DriveFolder& drive_;
  std::optional<double> revolution_s_;
};

}  // namespace atlas
