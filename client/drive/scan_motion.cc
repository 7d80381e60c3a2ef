#include "client/drive/scan_motion.h"

#include <optional>

#include "client/drive/drive_selection.h"

namespace atlas {

Pose MotionDuring(const DriveFolder& drive, std::size_t index) {
  const auto motion = [&drive](std::size_t from, std::size_t to) -> std::optional<Pose> {
    const DriveScan& a = drive.scans[from];
    const DriveScan& b = drive.scans[to];
    const Pose T_a_b = a.T_world_sensor.inverse() * b.T_world_sensor;
    const bool is_neighbour = b.number == a.number + 1;
    if (!is_neighbour || T_a_b.translation().norm() > kSessionJump_m) return std::nullopt;
    return T_a_b;
  };
  std::optional<Pose> found;
  if (index + 1 < drive.scans.size()) found = motion(index, index + 1);
  if (!found && index > 0) found = motion(index - 1, index);
  return found.value_or(Pose::Identity());
}

}  // namespace atlas
