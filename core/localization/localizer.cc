#include "core/localization/localizer.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

namespace atlas {
namespace {

// T_world_sensor without its tilt but with `R_level_sensor`'s: what the IMU says about the vertical
// replaces what was predicted.
Pose LevelFrame(const Pose& T_world_sensor) {
  Pose level = Pose::Identity();
  const double yaw_rad = SplitYaw(Eigen::Quaterniond(T_world_sensor.linear())).yaw_rad;
  level.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  level.translation() = T_world_sensor.translation();
  return level;
}

}  // namespace

std::string_view LocalizationHealthName(LocalizationHealth health) {
  switch (health) {
    case LocalizationHealth::kGood:
      return "good";
    case LocalizationHealth::kWeak:
      return "weak";
    case LocalizationHealth::kLost:
      return "lost";
  }
  return "lost";
}

Localizer::Localizer(const MapProfile& profile, TilesAround tiles, const LocalizerOptions& options)
    : profile_(profile), tiles_(std::move(tiles)), options_(options) {}

void Localizer::Start(const Pose& T_world_sensor) {
  last_ = T_world_sensor;
  motion_.reset();
  was_good_ = false;
  is_first_ = true;
  usual_fit_ = 0.0;
  lost_ = 0;
}

Result<LocalizationResult> Localizer::Localize(const LeveledScan& scan,
                                               const Eigen::Quaterniond& R_level_sensor) {
  const Pose predicted = motion_ ? last_ * *motion_ : last_;
  if (Status status = RenewWindow(predicted.translation()); !status.ok()) {
    return Error(std::move(status));
  }
  const ScanFeatures features = ExtractFeatures(scan, options_.features);
  const Pose T_world_level = LevelFrame(predicted);
  LocalizationResult result;
  result.registration = Track(features, T_world_level);
  if (IsDoubtful(result.registration)) {
    if (auto found = Search(features, T_world_level, result.registration)) {
      result.registration = *std::move(found);
    }
  }
  result.health = Judge(result.registration);
  const bool is_lost = result.health == LocalizationHealth::kLost;
  const Pose& believed = is_lost ? T_world_level : result.registration.T_world_level;
  result.T_world_sensor = believed;
  result.T_world_sensor.linear() = believed.linear() * R_level_sensor.toRotationMatrix();
  Remember(result);
  return result;
}

void Localizer::Remember(const LocalizationResult& result) {
  if (result.health == LocalizationHealth::kGood) {
    const double fit = result.registration.fit;
    usual_fit_ = usual_fit_ == 0.0 ? fit : 0.8 * usual_fit_ + 0.2 * fit;
  }
  if (result.health == LocalizationHealth::kLost) {
    ++lost_;
    if (lost_ > options_.max_coasting) {
      motion_.reset();  // looked for where it got to
    }
  } else {
    const bool is_good = result.health == LocalizationHealth::kGood;
    if (!is_first_ && lost_ == 0 && (motion_ || (is_good && was_good_))) {
      motion_ = last_.inverse() * result.T_world_sensor;
    }
    lost_ = 0;
  }
  last_ = result.T_world_sensor;
  was_good_ = result.health == LocalizationHealth::kGood;
  is_first_ = false;
}

Status Localizer::RenewWindow(const Eigen::Vector3d& center) {
  if (window_ && (center - window_center_).norm() < 0.5 * options_.window_margin_m) {
    return {};
  }
  const double radius_m =
      static_cast<double>(options_.features.max_range_m) + options_.window_margin_m;
  const auto tiles = tiles_(center, radius_m);
  if (!tiles) {
    return tiles.error();
  }
  std::vector<const Tile*> views;
  views.reserve(tiles->size());
  for (const auto& tile : *tiles) {
    views.push_back(tile.get());
  }
  window_.emplace(profile_, views, center, radius_m, options_.window);
  window_center_ = center;
  coarse_.reset();
  return {};
}

std::vector<Pose> Localizer::AheadHypotheses(const Pose& T_world_level) const {
  std::vector<Pose> starts{T_world_level};
  if (!is_first_ && !motion_) {
    const Eigen::Vector3d ahead = T_world_level.linear().col(0);
    const int steps = static_cast<int>(options_.search_ahead_m / options_.search_step_m);
    for (int step = 1; step <= steps; ++step) {
      starts.push_back(T_world_level);
      starts.back().translation() += step * options_.search_step_m * ahead;
    }
  }
  return starts;
}

RegistrationResult Localizer::Track(const ScanFeatures& features, const Pose& T_world_level) const {
  RegistrationOptions options = options_.registration;
  if (!is_first_) {
    options.start_sigma_m = options_.predicted_sigma_m;
    options.start_sigma_rad = options_.predicted_sigma_rad;
  }
  std::optional<RegistrationResult> best;
  for (const Pose& start : AheadHypotheses(T_world_level)) {
    RegistrationResult result = Register(*window_, features, start, options);
    if (!best || result.fit > best->fit) {
      best = std::move(result);
    }
  }
  return *best;
}

bool Localizer::IsDoubtful(const RegistrationResult& result) const {
  return lost_ > 0 || result.fit < (is_first_ ? options_.good_fit : options_.min_fit) ||
         result.fit < options_.doubtful_fit * usual_fit_;
}

std::optional<RegistrationResult> Localizer::Search(const ScanFeatures& features,
                                                    const Pose& T_world_level,
                                                    const RegistrationResult& tracked) {
  if (!coarse_) {
    coarse_.emplace(*window_, options_.search.block_m);
  }
  const SearchReach reach{
      std::min((1 + lost_) * options_.search_reach.distance_m,
               options_.max_search_reach.distance_m),
      std::min((1 + lost_) * options_.search_reach.yaw_rad, options_.max_search_reach.yaw_rad)};
  std::optional<RegistrationResult> best;
  for (const Pose& start :
       SearchPoses(*coarse_, window_->origin(), features, T_world_level, reach, options_.search)) {
    RegistrationResult result = Register(*window_, features, start, options_.registration);
    if (!best || result.fit > best->fit) {
      best = std::move(result);
    }
  }
  const bool is_believed = best && best->fit > options_.believed_gain * tracked.fit;
  return is_believed ? best : std::nullopt;
}

LocalizationHealth Localizer::Judge(const RegistrationResult& result) const {
  if (result.fit < options_.min_fit) {
    return LocalizationHealth::kLost;
  }
  const Eigen::Matrix2d horizontal = result.information.topLeftCorner<2, 2>();
  const double least = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(horizontal).eigenvalues()(0);
  const double sigma_m = least > 0.0 ? 1.0 / std::sqrt(least) : 1e9;
  return sigma_m > options_.max_weak_sigma_m || result.fit < options_.good_fit
             ? LocalizationHealth::kWeak
             : LocalizationHealth::kGood;
}

}  // namespace atlas
