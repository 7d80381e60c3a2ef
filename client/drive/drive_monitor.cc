#include "client/drive/drive_monitor.h"

#include <utility>

#include "client/drive/tiles_around.h"
#include "client/score/cpu_timer.h"

namespace atlas {

DriveMonitor::DriveMonitor(MapView& view,
                           const MonitorOptions& options,
                           OnContradiction on_contradiction)
    : monitor_(view.profile(), TilesOf(view), options, std::move(on_contradiction)) {}

Status DriveMonitor::Observe(const LeveledScan& leveled,
                             const Eigen::Quaterniond& R_level_sensor,
                             const LocalizationResult& result) {
  if (result.health == LocalizationHealth::kLost) return {};
  const CpuTimer timer;
  Pose T_world_level = result.T_world_sensor;
  T_world_level.linear() *= R_level_sensor.toRotationMatrix().transpose();
  Status status = monitor_.Observe(leveled, T_world_level, result.covariance, scan_);
  cpu_s_ += timer.elapsed_s();
  return status;
}

}  // namespace atlas
