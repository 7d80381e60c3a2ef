#include "client/drive/anchor/scan_follower.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "client/drive/tiles_around.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr double kRange_m = 100.0;
constexpr std::size_t kLastScans = 10;  // that say how the drive lies here
constexpr double kNextDeck_m = 3.0;     // is no nearer

LocalizerOptions OptionsOfLocalizer() {
  LocalizerOptions options;
  options.features.max_range_m = static_cast<float>(kRange_m);
  return options;
}

}  // namespace

std::vector<double> WaysOf(PartScans scans) {
  std::vector<double> way_m{0.0};
  for (std::size_t i = 1; i < scans.size(); ++i) {
    way_m.push_back(way_m.back() + (scans[i]->T_world_sensor.translation() -
                                    scans[i - 1]->T_world_sensor.translation())
                                       .norm());
  }
  return way_m;
}

std::vector<std::size_t> SpreadAlong(const std::vector<double>& way_m,
                                     std::size_t count,
                                     double spacing_m) {
  const double step_m = std::max(spacing_m, way_m.back() / static_cast<double>(count));
  std::vector<std::size_t> spread;
  for (std::size_t i = 0; i < way_m.size(); ++i) {
    if (spread.empty() || way_m[i] >= way_m[spread.back()] + step_m) spread.push_back(i);
  }
  return spread;
}

ScanFollower::ScanFollower(const DriveSurvey& survey,
                           const ScanSource& source,
                           MapView& view,
                           const FollowOptions& options)
    : options_(options),
      mount_m_(survey.mount.height_m),
      source_(source),
      view_(&view),
      localizer_(view.profile(), TilesOf(view), OptionsOfLocalizer()),
      tracker_(view.profile(), TilesOf(view), OptionsOfLocalizer()) {}

Result<std::vector<FollowedScan>> ScanFollower::Follow(PartScans scans,
                                                       std::size_t seed,
                                                       const LevelTransform& T_map_drive,
                                                       bool is_led) {
  const std::vector<double> way_m = WaysOf(scans);
  std::vector<std::size_t> forwards;
  std::vector<std::size_t> backwards;
  for (const std::size_t i : SpreadAlong(way_m, way_m.size(), options_.spacing_m)) {
    if (i != seed) (i > seed ? forwards : backwards).push_back(i);
  }
  std::reverse(backwards.begin(), backwards.end());
  std::vector<FollowedScan> followed;
  for (auto* order : {&backwards, &forwards}) {
    order->insert(order->begin(), seed);
    Status status = Follow(scans, way_m, *order, T_map_drive, is_led, followed);
    if (!status.ok()) return Error(std::move(status));
  }
  std::stable_sort(followed.begin(), followed.end(),
                   [](const FollowedScan& a, const FollowedScan& b) { return a.index < b.index; });
  // The seed was looked at twice.
  const auto end =
      std::unique(followed.begin(), followed.end(),
                  [](const FollowedScan& a, const FollowedScan& b) { return a.index == b.index; });
  followed.erase(end, followed.end());
  return followed;
}

Status ScanFollower::Follow(PartScans scans,
                            const std::vector<double>& way_m,
                            const std::vector<std::size_t>& order,
                            const LevelTransform& T_map_drive,
                            bool is_led,
                            std::vector<FollowedScan>& followed) {
  Pose T_here = T_map_drive.ToPose();
  double last_m = way_m[order.front()];
  double driven_m = last_m;
  std::vector<FoundScan> last;
  tracker_.Begin();
  for (const std::size_t i : order) {
    const double step_m = std::abs(way_m[i] - driven_m);
    const Expected expected{T_here * scans[i]->T_world_sensor,
                            options_.drift * std::abs(way_m[i] - last_m),
                            is_led ? std::optional(step_m) : std::nullopt};
    const auto looked = LookAt(*scans[i], expected);
    if (!looked) return looked.error().WithContext(StrCat("scan ", scans[i]->number));
    driven_m = way_m[i];
    if (looked->is_found) {
      const FoundScan found{scans[i]->T_world_sensor, looked->T_map_sensor};
      followed.push_back({i, true, looked->fit, found});
      last.push_back(found);
      if (last.size() > kLastScans) last.erase(last.begin());
      T_here = FitTransform(last).ToPose();
      last_m = way_m[i];
    } else if (looked->is_astray) {
      followed.push_back({i, false, 0.0, {}});
    }
  }
  return {};
}

Result<ScanFollower::Looked> ScanFollower::LookAt(const DriveScan& scan, const Expected& expected) {
  constexpr StartHint kExpected{0.5, 0.05};  // the scans before it tell where it is
  const Result<LeveledScan> leveled = source_.Read(scan);
  if (!leveled) return Error(leveled.error());
  const Eigen::Quaterniond R_level_sensor = LevelOf(scan);
  localizer_.Start(expected.T_map_sensor, kExpected);
  const auto located = localizer_.Localize(*leveled, R_level_sensor);
  if (!located) return Error(located.error());
  bool is_led_elsewhere = false;
  if (expected.step_m) {
    const auto led =
        tracker_.Track(*leveled, R_level_sensor, expected.T_map_sensor, *expected.step_m);
    if (!led) return Error(led.error());
    is_led_elsewhere =
        led->health == LocalizationHealth::kGood && !IsNear(led->T_world_sensor, expected);
  }
  const bool is_good = located->health == LocalizationHealth::kGood;
  const bool is_near =
      located->health != LocalizationHealth::kLost && IsNear(located->T_world_sensor, expected);
  Looked looked;
  looked.is_found = is_good && is_near && !is_led_elsewhere;
  looked.T_map_sensor = located->T_world_sensor;
  looked.fit = located->registration.fit;
  if (looked.is_found) return looked;
  const Result<bool> is_astray = is_good || is_led_elsewhere ? true
                                 : is_near                   ? IsOffGround(expected.T_map_sensor)
                                                             : IsMapped(expected);
  if (!is_astray) return Error(is_astray.error());
  looked.is_astray = *is_astray;
  return looked;
}

// Whether the map has ground there that a vehicle with such a sensor would hover over, or be below.
// Walls hold a scan in plan at any height.
Result<bool> ScanFollower::IsOffGround(const Pose& T_map_sensor) const {
  constexpr double kStands_m = 0.5;
  const Eigen::Vector3d& p = T_map_sensor.translation();
  const auto layers = view_->LayersAt(p.head<2>());
  if (!layers) return Error(layers.error());
  double off_m = std::numeric_limits<double>::infinity();
  for (const TileLayer& layer : *layers) {
    off_m = std::min(off_m, std::abs(1e-3 * layer.altitude_mm - (p.z() - mount_m_)));
  }
  return off_m > kStands_m && off_m < kNextDeck_m;
}

// Whether the map has ground below a sensor there, or beside it, which may be `slack_m` farther.
Result<bool> ScanFollower::IsMapped(const Expected& expected) const {
  constexpr double kBeside_m = 2.0;
  constexpr double kNear_m = 1.5;
  constexpr double kMostSlack_m = 10.0;
  const double slack_m = expected.slack_m;
  const Eigen::Vector3d& p = expected.T_map_sensor.translation();
  const double ground_z_m = p.z() - mount_m_;
  const double near_m = std::min(kNear_m + slack_m, kNextDeck_m);
  std::vector<double> offsets_m{0.0, -kBeside_m, kBeside_m};
  for (double m = 2.0 * kBeside_m; m < kBeside_m + std::min(slack_m, kMostSlack_m);
       m += kBeside_m) {
    offsets_m.insert(offsets_m.end(), {-m, m});
  }
  for (const double dx_m : offsets_m) {
    for (const double dy_m : offsets_m) {
      const auto layers = view_->LayersAt({p.x() + dx_m, p.y() + dy_m});
      if (!layers) return Error(layers.error());
      const bool is_near = std::any_of(layers->begin(), layers->end(), [&](const TileLayer& layer) {
        return std::abs(1e-3 * layer.altitude_mm - ground_z_m) <= near_m;
      });
      if (is_near) return true;
    }
  }
  return false;
}

bool ScanFollower::IsNear(const Pose& found, const Expected& expected) const {
  const Pose& T_map_sensor = expected.T_map_sensor;
  const Eigen::AngleAxisd turned(found.linear().transpose() * T_map_sensor.linear());
  return (found.translation() - T_map_sensor.translation()).norm() <=
             options_.max_surprise_m + expected.slack_m &&
         turned.angle() <= options_.max_surprise_rad;
}

}  // namespace atlas
