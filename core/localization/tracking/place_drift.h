// How far a place went elsewhere than the vehicle, as its own scans tell: one that looks like where
// it is goes along with what repeats itself (decisions 0632 and 0634).
#pragma once

#include <optional>

#include <Eigen/Core>

namespace atlas {

struct PlaceDriftOptions {
  // Where all is well places stray by 0.01 to 0.05 m a scan, where what is left of a map that ends
  // repeats itself by 0.2 to 1 m. Further than so, in all, it strayed.
  double most_m = 0.3;
  double most_rad = 0.05;
  double kept = 0.9;  // from scan to scan: own motion errs, too
  // Asked is where a vehicle is so far, per usual interval, from where it was expected: it brakes
  // by less.
  double unexpected_m = 0.15;
  // Two steps that differ by no more are the same.
  double same_step_m = 0.5;
  double same_step_rad = 0.05;
  // So far around where a place that is not confirmed has come to its own motion is looked for.
  double unsure_m = 1.0;
};

// All are (x, y, z, yaw) from where own motion leads to where the place was found.
class PlaceDrift {
 public:
  explicit PlaceDrift(const PlaceDriftOptions& options) : options_(options) {}

  void Clear();

  // Of a known place, summed up and forgotten from scan to scan.
  void Fade() { strayed_ *= options_.kept; }
  void Stray(const Eigen::Vector4d& off) { strayed_ += off; }
  bool HasStrayed() const;
  const Eigen::Vector4d& strayed() const { return strayed_; }
  void Return() { strayed_.setZero(); }

  // Whether a place that is not confirmed moved as the vehicle did since it was taken up or last
  // did not. Nothing: nobody knows how the vehicle moved.
  bool MovesAlong(const std::optional<Eigen::Vector4d>& off);
  void Confirm() { moved_off_.setZero(); }
  // The same of one where a vehicle that is carried may be: it stays as far off as it was.
  bool StaysOff(const Eigen::Vector4d& off);
  void EndCarry() { off_carried_.reset(); }

 private:
  bool IsSameStep(const Eigen::Vector4d& difference) const;

  PlaceDriftOptions options_;
  Eigen::Vector4d strayed_ = Eigen::Vector4d::Zero();
  Eigen::Vector4d moved_off_ = Eigen::Vector4d::Zero();
  std::optional<Eigen::Vector4d> off_carried_;
};

}  // namespace atlas
