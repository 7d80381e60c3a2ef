// One way to find scans in a map, behind one face: ours, the paper's, or a benchmark's own.
#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "client/drive/drive_survey.h"
#include "client/map/map_view.h"
#include "core/base/status.h"
#include "core/localization/localizer.h"
#include "core/scan/point_cloud.h"

namespace atlas {

struct LocatedScan {
  Pose T_world_sensor = Pose::Identity();
  LocalizationHealth health = LocalizationHealth::kLost;
  double fit = 0.0;                          // 0..1, as the method understands it
  std::optional<PoseCovariance> covariance;  // of methods that know how sure they are
  std::optional<MapCover> cover;             // of methods that look
};

class ScanLocalizer {
 public:
  ScanLocalizer() = default;
  ScanLocalizer(const ScanLocalizer&) = delete;
  ScanLocalizer& operator=(const ScanLocalizer&) = delete;
  virtual ~ScanLocalizer() = default;

  // Forgets the motion; the next scan is near `T_world_sensor`. Methods that know how sure they are
  // go by how well that is known (core/localization/localizer.h).
  virtual void Start(const Pose& T_world_sensor, const StartKnowledge& known) = 0;
  // Requires Start(). `R_level_sensor` is what the IMU says; the scan comes `scans` times the usual
  // time after the last one. Errors are those of the map's source.
  virtual Result<LocatedScan> Locate(const PointCloud& cloud,
                                     const Eigen::Quaterniond& R_level_sensor,
                                     double scans) = 0;
};

// A scan as it was matched, and where; an error ends the localization.
using OnLocalization = std::function<Status(const LeveledScan& leveled,
                                            const Eigen::Quaterniond& R_level_sensor,
                                            const LocalizationResult& result)>;

// Both match what is within `max_range_m`; `view` outlives them.
//
// The product's (core/localization/localizer.h). With `revolutions`, how many the sensor makes from
// one scan to the next, scans are deskewed by the motion that the localizer predicts.
// `on_localization` may be empty.
std::unique_ptr<ScanLocalizer> MakeAtlasLocalizer(const DriveSurvey& survey,
                                                  double max_range_m,
                                                  MapView& view,
                                                  std::optional<double> revolutions = std::nullopt,
                                                  OnLocalization on_localization = {});
// The paper's encode, decode and ICP (core/localization/icp). `survey` with its mount;
// kInvalidArgument for a range that no keyframe has.
Result<std::unique_ptr<ScanLocalizer>> MakePaperLocalizer(const DriveSurvey& survey,
                                                          double max_range_m,
                                                          MapView& view);

}  // namespace atlas
