#include "client/drive/anchor/scan_source.h"

#include "core/keyframe/keyframe_builder.h"
#include "core/scan/scan_reader.h"

namespace atlas {

Result<LeveledScan> ScanSource::Read(const DriveScan& scan) const {
  const Result<PointCloud> cloud = ReadScan(scan.scan);
  if (!cloud) return Error(cloud.error());
  return SegmentScan(*cloud, survey_.layout, survey_.ring_step, LevelOf(scan), {},
                     motion_ ? motion_(scan) : std::nullopt);
}

Eigen::Quaterniond LevelOf(const DriveScan& scan) {
  return SplitYaw(Eigen::Quaterniond(scan.T_world_sensor.linear())).R_level_sensor;
}

}  // namespace atlas
