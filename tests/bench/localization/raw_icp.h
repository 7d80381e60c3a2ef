// What can be had from the raw returns: point-to-plane ICP of a scan against all returns of the
// drive that the map was made of. No map that anyone would ship; a yardstick.
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "client/drive/drive_selection.h"
#include "client/drive/scan_localizer.h"
#include "core/base/status.h"
#include "core/localization/icp/point_index.h"
#include "core/scan/drive_folder.h"

namespace atlas::testing {

struct RawIcpOptions {
  float max_range_m = 40.0F;       // of the map's returns and of the scan's, horizontal
  std::size_t normal_points = 12;  // neighbours that a plane is laid through ...
  float normal_reach_m = 1.0F;     // ... from within
  float max_thickness = 0.3F;      // root of the ratio of its least and its middle variance
  float coarse_reach_m = 1.5F;     // how far a return is paired at first ...
  float fine_reach_m = 0.3F;       // ... and in the end
  float voxel_m = 0.25F;           // one return of a scan per voxel is matched
  int max_iterations = 30;
  double converged_m = 1e-3;  // as RegistrationOptions
  double converged_rad = 1e-4;
  // Geman-McClure: this share of the reach, but not less than so much.
  float kernel_share = 0.3F;
  float min_kernel_m = 0.05F;
};

class RawIcp : public ScanLocalizer {
 public:
  // All returns of the selected scans, as their poses say. Errors are those of reading them.
  static Result<std::unique_ptr<RawIcp>> Make(const DriveFolder& drive,
                                              const DriveSurvey& survey,
                                              const SelectionOptions& selection,
                                              const RawIcpOptions& options);

  void Start(const Pose& T_world_sensor, const StartKnowledge& /*known*/) override {
    T_world_sensor_ = T_world_sensor;
  }
  // Roll and pitch of the start are the IMU's; all six are refined.
  Result<LocatedScan> Locate(const PointCloud& cloud,
                             const Eigen::Quaterniond& R_level_sensor,
                             double scans) override;

 private:
  RawIcp(const DriveSurvey& survey,
         const RawIcpOptions& options,
         const Eigen::Vector3d& origin,
         std::vector<Eigen::Vector3f> points);
  struct Equations;
  Equations Linearize(const std::vector<Eigen::Vector3f>& scan,
                      const Pose& T_map_sensor,
                      float reach_m) const;

  DriveSurvey survey_;
  RawIcpOptions options_;
  Eigen::Vector3d origin_;  // of the map's frame, in the world
  PointIndex map_;
  std::vector<Eigen::Vector3f> normals_;  // zero where the returns lie in no plane
  Pose T_world_sensor_ = Pose::Identity();
};

}  // namespace atlas::testing
