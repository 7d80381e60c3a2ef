// Watches a map while a recorded drive is tracked in it (core/localization/monitor).
#pragma once

#include <cstdint>

#include <Eigen/Geometry>

#include "client/map/map_view.h"
#include "core/base/status.h"
#include "core/localization/localizer.h"
#include "core/localization/monitor/map_monitor.h"
#include "core/scan/leveled_scan.h"

namespace atlas {

class DriveMonitor {
 public:
  // `view` outlives it.
  DriveMonitor(MapView& view, const MonitorOptions& options, OnContradiction on_contradiction);

  // The number of the scan that is localized next.
  void Begin(std::uint32_t scan) { scan_ = scan; }
  // Where it is; a scan that is lost is no witness. Errors are those of the map's source.
  Status Observe(const LeveledScan& leveled,
                 const Eigen::Quaterniond& R_level_sensor,
                 const LocalizationResult& result);
  // Hands out what is still held.
  void Finish() { monitor_.Finish(); }

  std::uint64_t scans() const { return monitor_.scans(); }  // that were witnesses
  double cpu_s() const { return cpu_s_; }

 private:
  MapMonitor monitor_;
  std::uint32_t scan_ = 0;
  double cpu_s_ = 0.0;
};

}  // namespace atlas
