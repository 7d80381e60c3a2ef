#include "core/alignment/submap_match.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>

namespace atlas {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

struct OneWay {
  RegistrationResult result;
  double explained = 0.0;
};

template <typename Predicate>
std::vector<Eigen::Vector3f> Chosen(const std::vector<Eigen::Vector3f>& points,
                                    const Predicate& is_wanted) {
  std::vector<Eigen::Vector3f> chosen;
  std::copy_if(points.begin(), points.end(), std::back_inserter(chosen), is_wanted);
  return chosen;
}

template <std::size_t kCount>
std::array<Eigen::Vector2f, kCount> Directions() {
  std::array<Eigen::Vector2f, kCount> directions;
  for (std::size_t k = 0; k < kCount; ++k) {
    const float angle =
        2.0F * std::numbers::pi_v<float> * static_cast<float>(k) / static_cast<float>(kCount);
    directions[k] = {std::cos(angle), std::sin(angle)};
  }
  return directions;
}

// `seen` in `map`, as far as it could be seen by who made the map.
OneWay RegisterIn(const SubmapWindow& map,
                  const SubmapWindow& seen,
                  const Pose& T_map_seen,
                  const MatchOptions& options) {
  std::vector<Eigen::Vector3d> places;
  for (const SubmapPlace& place : map.submap().places()) {
    places.emplace_back(T_map_seen.inverse() * place.ground);
  }
  const ScanFeatures features = seen.SeenFrom(places, options);
  OneWay way;
  way.result = Register(map.window(), features, T_map_seen, options.registration);
  const auto columns = static_cast<double>(features.columns.size());
  way.explained = columns == 0.0 ? 0.0 : way.result.evidence / columns;
  return way;
}

// What is known of (t, w) of T_b_a, axes of b, as of (t', w') of its inverse, axes of a: with
// R and p of T_a_b, w = -R^T w' and t = -R^T (t' + p x w').
Matrix6 Inverted(const Matrix6& information_b_a, const Pose& T_a_b) {
  const Eigen::Matrix3d back = -T_a_b.linear().transpose();
  const Eigen::Vector3d p = T_a_b.translation();
  Eigen::Matrix3d p_cross;
  p_cross << 0.0, -p.z(), p.y(), p.z(), 0.0, -p.x(), -p.y(), p.x(), 0.0;
  Matrix6 changes = Matrix6::Zero();
  changes.topLeftCorner<3, 3>() = back;
  changes.topRightCorner<3, 3>() = back * p_cross;
  changes.bottomRightCorner<3, 3>() = back;
  return changes.transpose() * information_b_a * changes;
}

Pose Midway(const Pose& a, const Pose& b) {
  Pose middle = Pose::Identity();
  middle.translation() = 0.5 * (a.translation() + b.translation());
  middle.linear() =
      Eigen::Quaterniond(a.linear()).slerp(0.5, Eigen::Quaterniond(b.linear())).toRotationMatrix();
  return middle;
}

}  // namespace

Result<SubmapWindow> SubmapWindow::Make(const Submap& submap,
                                        const MapProfile& profile,
                                        const MatchOptions& options) {
  const auto tiles = submap.DecodeTiles(profile);
  if (!tiles) return Error(tiles.error());
  SubmapWindow window(submap, profile, options);
  window.window_.Renew(*tiles, Eigen::Vector3d::Zero(), submap.radius_m());
  const ScanFeatures& all = submap.features();
  const auto is_upright = [&](const Eigen::Vector3f& p) {
    return !window.IsFlat(p, options);
  };
  window.upright_ = {Chosen(all.columns, is_upright), all.ground, Chosen(all.returns, is_upright)};
  for (const Eigen::Vector3f& p : window.upright_.columns) {
    window.columns_facing_.push_back(window.FacingOf(p, options));
  }
  for (const Eigen::Vector3f& p : window.upright_.returns) {
    window.returns_facing_.push_back(window.FacingOf(p, options));
  }
  return window;
}

const CoarseOccupancy& SubmapWindow::coarse() {
  if (!coarse_) coarse_.emplace(window_, coarse_block_m_);
  return *coarse_;
}

ScanFeatures SubmapWindow::SeenFrom(const std::vector<Eigen::Vector3d>& places,
                                    const MatchOptions& options) const {
  std::vector<Eigen::Vector2f> viewers;
  for (const Eigen::Vector3d& place : places) {
    viewers.emplace_back(place.head<2>().cast<float>());
  }
  const auto seen = [&](const std::vector<Eigen::Vector3f>& points,
                        const std::vector<Eigen::Vector2f>& facing) {
    std::vector<Eigen::Vector3f> chosen;
    chosen.reserve(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const bool is_turned_away =
          facing[i] != Eigen::Vector2f::Zero() &&
          std::all_of(viewers.begin(), viewers.end(), [&](const Eigen::Vector2f& viewer) {
            const Eigen::Vector2f towards = viewer - points[i].head<2>();
            return facing[i].dot(towards) < options.min_facing * towards.norm();
          });
      if (!is_turned_away) chosen.push_back(points[i]);
    }
    return chosen;
  };
  return {seen(upright_.columns, columns_facing_), upright_.ground,
          seen(upright_.returns, returns_facing_)};
}

bool SubmapWindow::IsFlat(const Eigen::Vector3f& p, const MatchOptions& options) const {
  static const std::array<Eigen::Vector2f, 8> kDirections = Directions<8>();
  const Eigen::Vector3f middle = p - window_.origin().cast<float>();
  int occupied = 0;
  for (const Eigen::Vector2f& direction : kDirections) {
    Eigen::Vector3f at = middle;
    at.head<2>() += options.flat_reach_m * direction;
    occupied += window_.IsOccupied(at) ? 1 : 0;
  }
  return occupied >= options.flat_directions;
}

Eigen::Vector2f SubmapWindow::FacingOf(const Eigen::Vector3f& p,
                                       const MatchOptions& options) const {
  constexpr std::size_t kAround = 16;
  constexpr float kClear = 1.0F;  // less tells no side
  static const std::array<Eigen::Vector2f, kAround> kDirections = Directions<kAround>();
  const Eigen::Vector3f middle = p - window_.origin().cast<float>();
  Eigen::Vector2f facing = Eigen::Vector2f::Zero();
  for (const Eigen::Vector2f& direction : kDirections) {
    Eigen::Vector3f at = middle;
    at.head<2>() += options.facing_reach_m * direction;
    if (window_.IsFree(at)) facing += direction;
  }
  const float length = facing.norm();
  return length < kClear ? Eigen::Vector2f::Zero() : Eigen::Vector2f(facing / length);
}

SubmapMatch MatchSubmaps(const SubmapWindow& a,
                         const SubmapWindow& b,
                         const Pose& T_a_b_start,
                         const MatchOptions& options) {
  const OneWay a_way = RegisterIn(a, b, T_a_b_start, options);
  const RegistrationResult& there = a_way.result;
  SubmapMatch match;
  if (there.fit < options.min_fit || there.column_inliers < options.min_columns) {
    match.T_a_b = there.T_world_level;
    match.fit = there.fit;
    match.columns = there.column_inliers;
    match.explained = a_way.explained;
    match.sigma_m = WorstSigma(there);
    return match;
  }
  const OneWay b_way = RegisterIn(b, a, T_a_b_start.inverse(), options);
  const RegistrationResult& back = b_way.result;
  const Pose T_a_b_back = back.T_world_level.inverse();
  match.T_a_b = Midway(there.T_world_level, T_a_b_back);
  match.information = there.information + Inverted(back.information, match.T_a_b);
  match.fit = std::min(there.fit, back.fit);
  match.columns = std::min(there.column_inliers, back.column_inliers);
  match.explained = std::min(a_way.explained, b_way.explained);
  match.sigma_m = std::max(WorstSigma(there), WorstSigma(back));
  match.apart_m = (there.T_world_level.translation() - T_a_b_back.translation()).norm();
  match.apart_rad = Eigen::Quaterniond(there.T_world_level.linear())
                        .angularDistance(Eigen::Quaterniond(T_a_b_back.linear()));
  return match;
}

bool IsBelieved(const SubmapMatch& match, const MatchOptions& options) {
  return match.fit >= options.min_fit && match.columns >= options.min_columns &&
         match.sigma_m <= options.max_sigma_m && match.apart_m <= options.max_apart_m &&
         match.apart_rad <= options.max_apart_rad;
}

std::vector<Pose> SearchSubmap(SubmapWindow& a,
                               const Submap& b,
                               const Pose& T_a_b_start,
                               const SearchReach& reach,
                               const MatchOptions& options) {
  return SearchPoses(a.coarse(), a.window().origin(), b.features(), T_a_b_start, reach,
                     options.search);
}

}  // namespace atlas
