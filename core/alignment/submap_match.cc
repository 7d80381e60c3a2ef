#include "core/alignment/submap_match.h"

#include <algorithm>
#include <cmath>

namespace atlas {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

RegistrationResult RegisterIn(const SubmapWindow& map,
                              const SubmapWindow& seen,
                              const Pose& start,
                              const MatchOptions& options) {
  return Register(map.window(), seen.submap().features(), start, options.registration);
}

double Explained(const RegistrationResult& result, const Submap& seen) {
  const auto columns = static_cast<double>(seen.features().columns.size());
  return columns == 0.0 ? 0.0 : result.evidence / columns;
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
  return window;
}

const CoarseOccupancy& SubmapWindow::coarse() {
  if (!coarse_) coarse_.emplace(window_, coarse_block_m_);
  return *coarse_;
}

SubmapMatch MatchSubmaps(const SubmapWindow& a,
                         const SubmapWindow& b,
                         const Pose& T_a_b_start,
                         const MatchOptions& options) {
  const RegistrationResult there = RegisterIn(a, b, T_a_b_start, options);
  const RegistrationResult back = RegisterIn(b, a, T_a_b_start.inverse(), options);
  const Pose T_a_b_back = back.T_world_level.inverse();
  SubmapMatch match;
  match.T_a_b = Midway(there.T_world_level, T_a_b_back);
  match.information = there.information + Inverted(back.information, match.T_a_b);
  match.fit = std::min(there.fit, back.fit);
  match.columns = std::min(there.column_inliers, back.column_inliers);
  match.explained = std::min(Explained(there, b.submap()), Explained(back, a.submap()));
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
