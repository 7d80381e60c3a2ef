#include "client/drive/drive_skew.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <vector>

#include "core/base/str_cat.h"
#include "core/keyframe/keyframe_builder.h"
#include "core/scan/scan_reader.h"

namespace atlas {
namespace {

struct Window {
  std::size_t begin = 0;
  double motion_m = 0.0;  // of its slowest scan
};

// The fastest ones, none over another.
std::vector<Window> FastWindows(const DriveFolder& drive,
                                const DriveMotion& motion,
                                const SkewOptions& options) {
  std::vector<Window> all;
  for (std::size_t begin = 0; begin + options.window_scans <= drive.scans.size(); ++begin) {
    Window window{begin, 1e9};
    for (std::size_t i = begin; i < begin + options.window_scans; ++i) {
      window.motion_m = std::min(window.motion_m, motion.During(i).translation().norm());
    }
    if (window.motion_m >= options.min_motion_m) all.push_back(window);
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Window& a, const Window& b) { return a.motion_m > b.motion_m; });
  std::vector<Window> apart;
  for (const Window& window : all) {
    const bool is_free = std::all_of(apart.begin(), apart.end(), [&](const Window& other) {
      return window.begin >= other.begin + options.window_scans ||
             other.begin >= window.begin + options.window_scans;
    });
    if (is_free && apart.size() < options.windows) apart.push_back(window);
  }
  return apart;
}

// What stands around the scans of a window, in voxels.
class Structure {
 public:
  explicit Structure(const SkewOptions& options) : options_(options) {}

  void Add(const LeveledScan& scan, const Pose& T_world_level) {
    for (std::size_t i = 0; i < scan.size(); ++i) {
      if (scan.is_ground[i] != 0 || scan.range_m[i] > options_.max_range_m) continue;
      const Eigen::Vector3d p =
          T_world_level * Eigen::Vector3f(scan.x[i], scan.y[i], scan.z[i]).cast<double>();
      voxels_.insert({static_cast<int>(std::floor(p.x() / options_.voxel_m)),
                      static_cast<int>(std::floor(p.y() / options_.voxel_m)),
                      static_cast<int>(std::floor(p.z() / options_.voxel_height_m))});
    }
  }
  std::size_t voxels() const { return voxels_.size(); }

 private:
  const SkewOptions& options_;
  std::set<std::array<int, 3>> voxels_;
};

}  // namespace

Status DeskewOptions::Validate() const {
  if (!revolution_s) return {};
  if (deskewing == Deskewing::kOff) {
    return {StatusCode::kInvalidArgument,
            "a revolution (--revolution) is for deskewing (--deskew)"};
  }
  if (!(*revolution_s >= 0.01 && *revolution_s <= 2.0)) {
    return {StatusCode::kInvalidArgument,
            StrCat("a revolution of ", *revolution_s, " s: expected 0.01 to 2")};
  }
  return {};
}

Status DeskewOptions::Validate(const DriveFolder& drive) const {
  ATLAS_RETURN_IF_ERROR(Validate());
  if (!revolution_s) return {};
  for (std::size_t i = 0; i < drive.scans.size(); ++i) {
    const std::optional<double>& time_s = drive.scans[i].time_s;
    if (!time_s || (i > 0 && *time_s <= *drive.scans[i - 1].time_s)) {
      return {StatusCode::kInvalidArgument,
              StrCat(drive.path.string(),
                     ": what share of the way a revolution takes (--revolution) needs times.txt, "
                     "with times that rise: scan ",
                     drive.scans[i].number,
                     time_s ? " is not later than the one before" : " has none")};
    }
  }
  return {};
}

Result<DriveSkew> FindSkew(const DriveFolder& drive,
                           const DriveSurvey& survey,
                           const DriveMotion& motion,
                           const SkewOptions& options) {
  DriveSkew skew;
  std::size_t as_they_are = 0;
  std::size_t deskewed = 0;
  for (const Window& window : FastWindows(drive, motion, options)) {
    Structure raw(options);
    Structure undone(options);
    for (std::size_t i = window.begin; i < window.begin + options.window_scans; ++i) {
      const DriveScan& scan = drive.scans[i];
      const Result<PointCloud> cloud = ReadScan(scan.scan);
      if (!cloud) return Error(cloud.error());
      const Eigen::Quaterniond R_level_sensor =
          SplitYaw(Eigen::Quaterniond(scan.T_world_sensor.linear())).R_level_sensor;
      const Pose T_world_level = scan.T_world_sensor * R_level_sensor.conjugate();
      raw.Add(SegmentScan(*cloud, survey.layout, survey.ring_step, R_level_sensor, {}),
              T_world_level);
      undone.Add(SegmentScan(*cloud, survey.layout, survey.ring_step, R_level_sensor, {},
                             motion.During(i)),
                 T_world_level);
    }
    as_they_are += raw.voxels();
    deskewed += undone.voxels();
    ++skew.windows;
    skew.sharper_windows += undone.voxels() < raw.voxels() ? 1U : 0U;
  }
  if (as_they_are > 0) {
    skew.sharper = 1.0 - static_cast<double>(deskewed) / static_cast<double>(as_they_are);
    skew.is_skewed = skew.sharper >= options.min_sharper &&
                     static_cast<double>(skew.sharper_windows) >=
                         options.min_agreeing * static_cast<double>(skew.windows);
  }
  return skew;
}

Result<DeskewDecision> DecideDeskewing(Deskewing deskewing,
                                       const DriveFolder& drive,
                                       const DriveSurvey& survey,
                                       const DriveMotion& motion) {
  if (deskewing != Deskewing::kAuto) return DeskewDecision{deskewing == Deskewing::kOn};
  const auto skew = FindSkew(drive, survey, motion);
  if (!skew) return Error(skew.error());
  return DeskewDecision{skew->is_skewed, *skew};
}

Result<Deskewing> ParseDeskewing(const std::string& text) {
  if (text == "on") return Deskewing::kOn;
  if (text == "off") return Deskewing::kOff;
  if (text == "auto") return Deskewing::kAuto;
  return Error(StatusCode::kInvalidArgument,
               StrCat("deskew '", text.substr(0, 80), "': expected on, off or auto"));
}

}  // namespace atlas
