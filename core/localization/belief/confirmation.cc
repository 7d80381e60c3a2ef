#include "core/localization/belief/confirmation.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/localization/belief/map_edge.h"
#include "core/localization/registration/feature_fit.h"

namespace atlas {

void Confirmation::Trust() {
  Doubt();
  is_confirmed_ = true;
  uncompared_ = 0;
}

void Confirmation::Doubt() {
  is_confirmed_ = false;
  is_new_ = true;
  Miss();
}

void Confirmation::Question() {
  if (!is_confirmed_) {
    return;
  }
  Doubt();
  is_new_ = false;
}

void Confirmation::Miss() {
  usual_scans_ = 0;
  good_scans_ = 0;
  rivals_.clear();
}

bool Confirmation::IsEnough(const RegistrationResult& here, const ScanFeatures& features) const {
  return here.fit >= options_.good_fit && here.column_inliers >= options_.min_columns &&
         ExplainedShare(here, features) >= options_.min_explained;
}

bool Confirmation::IsAsUsual(const RegistrationResult& here,
                             const ScanFeatures& features,
                             double usual_fit) const {
  const double asked = usual_fit > 0.0
                           ? std::min(options_.usual_share * usual_fit, options_.usual_fit)
                           : options_.usual_fit;
  return here.fit >= asked && IsEnough(here, features);
}

std::optional<RegistrationResult> Confirmation::Weigh(const MapWindow& map,
                                                      const ScanFeatures& features,
                                                      const RegistrationResult& here,
                                                      double usual_fit,
                                                      bool is_doubtful) {
  if (is_confirmed_ && !is_suspected() && !is_doubtful && ++uncompared_ < options_.compared_after) {
    return std::nullopt;
  }
  uncompared_ = 0;
  Compare(map, features, here);
  const auto better =
      std::min_element(rivals_.begin(), rivals_.end(),
                       [&](const Rival& a, const Rival& b) { return Margin(a) < Margin(b); });
  const bool is_better = better != rivals_.end() && Margin(*better) <= -options_.taken_margin;
  if (is_confirmed_) {
    is_confirmed_ = !is_better || better->scans < options_.suspected_scans;
    is_new_ = !is_confirmed_;
    if (!is_better) rivals_.clear();
    return std::nullopt;
  }
  if (is_better && better->scans >= options_.usual_scans &&
      IsEnough(better->registration, features)) {
    const RegistrationResult there = better->registration;
    Doubt();
    return there;
  }
  Count(IsEnough(here, features), IsAsUsual(here, features, usual_fit));
  return std::nullopt;
}

void Confirmation::Count(bool is_good, bool is_usual) {
  good_scans_ = is_good ? good_scans_ + 1 : 0;
  usual_scans_ = is_usual ? usual_scans_ + 1 : 0;
  const bool is_spoken_for =
      usual_scans_ >= options_.usual_scans || good_scans_ >= options_.good_scans;
  if (is_spoken_for && IsAhead()) Trust();
}

// Of a place that is new the map has to tell more than that it ends at the rival.
bool Confirmation::IsAhead() const {
  return std::all_of(rivals_.begin(), rivals_.end(), [&](const Rival& rival) {
    const double lead = rival.is_at_edge ? std::min(rival.by_all, rival.by_common) : rival.by_all;
    return is_new_ ? options_.lead.IsClear(lead, rival.scans)
                   : Margin(rival) >= -options_.tracked_margin;
  });
}

double Confirmation::Margin(const Rival& rival) const {
  const bool is_by_both = is_confirmed_ || !is_new_ || is_at_edge_;
  return (is_by_both ? std::max(rival.by_all, rival.by_common) : rival.by_all) / rival.scans;
}

void Confirmation::Compare(const MapWindow& map,
                           const ScanFeatures& features,
                           const RegistrationResult& here) {
  const double score = PlaceScore(here, features);
  const double weight = DeckWeight(features, options_.many_columns);
  before_.swap(rivals_);
  rivals_.clear();
  const std::vector<double>& ups_m = decks_.Find(map, features, here.T_world_level);
  if (ups_m.empty()) {
    return;
  }
  const FeatureFit fit(map, features, registration_.features);
  fit.ColumnWeights(here.T_world_level, registration_.fine_radius_m, here_weights_);
  is_at_edge_ = IsAtEdge(map, features, here.T_world_level);
  for (const double up_m : ups_m) {
    Pose start = here.T_world_level;
    start.translation().z() += up_m;
    Rival rival;
    rival.registration = Register(map, features, start, registration_);
    rival.up_m =
        rival.registration.T_world_level.translation().z() - here.T_world_level.translation().z();
    if (std::abs(rival.up_m) < 0.5 * options_.decks.apart_m) {
      continue;  // it came back
    }
    const auto before = std::find_if(before_.begin(), before_.end(), [&](const Rival& other) {
      return std::abs(other.up_m - rival.up_m) < 0.5 * options_.decks.apart_m;
    });
    if (before != before_.end()) {
      rival.by_all = before->by_all;
      rival.by_common = before->by_common;
      rival.scans = before->scans;
    }
    rival.by_all += weight * (score - PlaceScore(rival.registration, features));
    fit.ColumnWeights(rival.registration.T_world_level, registration_.fine_radius_m,
                      rival_weights_);
    rival.by_common += CommonLead(here_weights_, rival_weights_, options_.many_columns);
    rival.is_at_edge = IsAtEdge(map, features, rival.registration.T_world_level);
    ++rival.scans;
    rivals_.push_back(rival);
  }
}

PoseCovariance Confirmation::Spread() const {
  const Eigen::Vector4d sigmas(options_.sigma_m, options_.sigma_m, options_.sigma_up_m,
                               options_.sigma_rad);
  return sigmas.cwiseAbs2().asDiagonal();
}

}  // namespace atlas
