// Where the vehicle is: keeps a map window around it, predicts its motion, matches each scan and
// says how far the answer can be believed.
#pragma once

#include <functional>
#include <memory>
#include <numbers>
#include <optional>
#include <string_view>
#include <vector>

#include "core/base/status.h"
#include "core/localization/map_window.h"
#include "core/localization/pose_search.h"
#include "core/localization/registration.h"
#include "core/localization/scan_features.h"

namespace atlas {

// Level-0 tiles that touch the square of `radius_m` around a place; they live as long as the
// result.
using TilesAround = std::function<Result<std::vector<std::shared_ptr<const Tile>>>(
    const Eigen::Vector3d& center, double radius_m)>;

enum class LocalizationHealth : std::uint8_t {
  kGood,
  kWeak,  // one horizontal direction is not held by anything seen
  kLost,  // the scan does not fit the map here: the pose is the predicted one
};
std::string_view LocalizationHealthName(LocalizationHealth health);

struct LocalizerOptions {
  FeatureOptions features;
  MapWindowOptions window;
  RegistrationOptions registration;
  double window_margin_m = 12.0;   // beyond the features' range; the window is renewed half-way
  double max_weak_sigma_m = 0.10;  // of the worst horizontal direction
  double min_fit = 0.25;           // of RegistrationResult; less: lost
  // Less is weak: wrong places within a few metres reach 0.44, right ones 0.46 and more.
  double good_fit = 0.45;
  // How well the motion model knows the next pose, once the speed is known.
  double predicted_sigma_m = 0.2;
  double predicted_sigma_rad = 0.01;
  int max_coasting = 10;  // scans that a lost vehicle is taken to go on as it did
  // While the speed is unknown, starts are tried this far ahead of the last pose.
  double search_ahead_m = 4.0;
  double search_step_m = 0.5;
  // A fit below this share of the usual one: the vehicle may have turned or braked more than
  // predicted, so other places and headings are tried, further off with every scan that is lost.
  // One is believed when its fit is better by this factor.
  double doubtful_fit = 0.85;
  double believed_gain = 1.1;
  SearchReach search_reach;  // of the first search; each lost scan adds as much
  SearchReach max_search_reach{8.0, std::numbers::pi};
  PoseSearchOptions search;
};

struct LocalizationResult {
  Pose T_world_sensor = Pose::Identity();
  LocalizationHealth health = LocalizationHealth::kLost;
  RegistrationResult registration;
};

class Localizer {
 public:
  Localizer(const MapProfile& profile, TilesAround tiles, const LocalizerOptions& options);

  // Forgets the motion; the next scan is near `T_world_sensor`.
  void Start(const Pose& T_world_sensor);

  // Requires Start(). `scan` is levelled by `R_level_sensor`. Errors are those of the tiles'
  // source.
  Result<LocalizationResult> Localize(const LeveledScan& scan,
                                      const Eigen::Quaterniond& R_level_sensor);

 private:
  Status RenewWindow(const Eigen::Vector3d& center);
  std::vector<Pose> AheadHypotheses(const Pose& T_world_level) const;
  RegistrationResult Track(const ScanFeatures& features, const Pose& T_world_level) const;
  bool IsDoubtful(const RegistrationResult& result) const;
  // The best around `T_world_level` where it beats `tracked`.
  std::optional<RegistrationResult> Search(const ScanFeatures& features,
                                           const Pose& T_world_level,
                                           const RegistrationResult& tracked);
  void Remember(const LocalizationResult& result);
  LocalizationHealth Judge(const RegistrationResult& result) const;

  MapProfile profile_;
  TilesAround tiles_;
  LocalizerOptions options_;
  std::optional<MapWindow> window_;
  std::optional<CoarseOccupancy> coarse_;  // of window_, made when a search needs it
  Eigen::Vector3d window_center_ = Eigen::Vector3d::Zero();
  Pose last_ = Pose::Identity();  // T_world_sensor
  std::optional<Pose> motion_;    // from one scan to the next, sensor frame
  bool was_good_ = false;         // the last scan: the speed is known from two such in a row
  bool is_first_ = true;
  double usual_fit_ = 0.0;  // of good results, exponentially forgotten
  int lost_ = 0;            // scans in a row
};

}  // namespace atlas
