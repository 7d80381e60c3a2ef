// How the sensor of a recorded drive moves during a scan, by the drive's own poses.
#pragma once

#include <cstddef>
#include <optional>

#include "core/geometry/pose.h"
#include "core/scan/drive_folder.h"

namespace atlas {

class DriveMotion {
 public:
  // The drive outlives this.
  explicit DriveMotion(const DriveFolder& drive);

  // T_now_later from scan `index` to the one numbered next, or to it from the one before; a jump is
  // no motion. Where times say that scans between the two are missing, in one revolution of the
  // sensor, which takes as long as two scans are apart as a rule. Identity, as for a sensor that
  // stands, where it has no neighbour.
  Pose During(std::size_t index) const;

 private:
  std::optional<Pose> Between(std::size_t from, std::size_t to) const;

  const DriveFolder& drive_;
  std::optional<double> usual_s_;
};

}  // namespace atlas
