#include "core/localization/registration/registration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "core/localization/registration/normal_equations.h"

namespace atlas {
namespace {

// What is known besides the scan.
struct Known {
  const PosePrior& prior;
  Eigen::Matrix4d information;  // of the prior
  double tilt_sigma_rad;

  void AddTo(const Pose& pose, NormalEquations& equations) const {
    equations.AddTiltPrior(pose, tilt_sigma_rad);
    equations.AddPrior(pose, prior.T_world_level, information);
  }
};

// Lines and planes reach far, but where two cells are as near a feature is pulled to either.
Pose AlignFeatures(const FeatureFit& features,
                   const Pose& start,
                   const Known& known,
                   const RegistrationOptions& options) {
  Pose pose = start;
  for (int iteration = 0; iteration < options.coarse_iterations; ++iteration) {
    const float left =
        1.0F - static_cast<float>(iteration) / static_cast<float>(options.coarse_iterations);
    const FeatureReach reach{
        options.fine_radius_m + left * (options.coarse_radius_m - options.fine_radius_m),
        options.fine_reach_m + left * (options.coarse_reach_m - options.fine_reach_m),
        options.coarse_stride};
    NormalEquations equations = features.At(pose, reach).equations;
    known.AddTo(pose, equations);
    pose = Moved(pose, equations.Solve());
  }
  return pose;
}

struct Alignment {
  Pose pose;
  bool is_converged = false;
};

// Newton's method on what is the same from wherever it begins. A step after which less of the scan
// lies in occupied segments is halved. Some returns find the place, all of them what is left of the
// way.
class ReturnAlignment {
 public:
  ReturnAlignment(const MapWindow& map,
                  const ScanFeatures& scan,
                  const FeatureFit& features,
                  const Known& known,
                  const RegistrationOptions& options)
      : map_(map), scan_(scan), features_(features), known_(known), options_(options) {}

  Alignment From(const Pose& start) const {
    const std::span all(scan_.returns);
    const auto few = all.first(all.size() / kFew);
    const double present = SumPresence(map_, few, start).present;
    if (present < options_.min_present * static_cast<double>(few.size())) {
      return AlongLines(start);
    }
    const Alignment near = Descend(start, few, kNear);
    return Descend(near.pose, all, {options_.converged_m, options_.converged_rad});
  }

 private:
  static constexpr std::size_t kFew = 4;  // of so many returns one, until the steps are small
  struct Small {
    double translation_m;
    double rotation_rad;
  };
  static constexpr Small kNear{0.01, 0.001};

  // Where hardly anything of the scan lies on what was mapped, there is nothing to count: what is
  // seen is the far edge of it.
  Alignment AlongLines(const Pose& start) const {
    Alignment result{start, false};
    for (int iteration = 0; iteration < options_.max_iterations && !result.is_converged;
         ++iteration) {
      NormalEquations equations =
          features_.At(result.pose, {options_.fine_radius_m, options_.fine_reach_m}).equations;
      known_.AddTo(result.pose, equations);
      const NormalEquations::Vector6 step = equations.Solve();
      result.pose = Moved(result.pose, step);
      result.is_converged = IsSmall(step, {options_.converged_m, options_.converged_rad});
    }
    return result;
  }

  static bool IsSmall(const NormalEquations::Vector6& step, const Small& small) {
    return step.head<3>().norm() < small.translation_m &&
           step.tail<3>().norm() < small.rotation_rad;
  }

  Alignment Descend(const Pose& start,
                    std::span<const Eigen::Vector3f> returns,
                    const Small& small) const {
    constexpr double kTolerated = 1e-4;  // of the likelihood: the ground may have its share
    Alignment result{start, false};
    Pose before = start;
    double best = 0.0;
    NormalEquations::Vector6 step = NormalEquations::Vector6::Zero();
    for (int iteration = 0; iteration < options_.max_iterations && !result.is_converged;
         ++iteration) {
      PresenceSum sum = SumPresence(map_, returns, result.pose);
      if (sum.log_likelihood < (1.0 - kTolerated) * best) {
        step *= 0.5;
      } else {
        best = sum.log_likelihood;
        before = result.pose;
        step = Step(std::move(sum.equations), result.pose, returns.size());
      }
      result.pose = Moved(before, step);
      result.is_converged =
          step.head<3>().norm() < small.translation_m && step.tail<3>().norm() < small.rotation_rad;
    }
    return result;
  }

  NormalEquations::Vector6 Step(NormalEquations equations,
                                const Pose& pose,
                                std::size_t returns) const {
    // All returns count as much as all columns: neighbours err together.
    equations *= static_cast<double>(scan_.columns.size()) /
                 static_cast<double>(std::max<std::size_t>(returns, 1));
    equations +=
        features_.OfGround(pose, {options_.fine_radius_m, options_.fine_reach_m}).equations;
    known_.AddTo(pose, equations);
    return equations.Solve();
  }

  const MapWindow& map_;
  const ScanFeatures& scan_;
  const FeatureFit& features_;
  const Known& known_;
  const RegistrationOptions& options_;
};

// Mapped features that a fit needs.
constexpr int kEnough = 30;

double Share(int part, std::size_t whole) {
  return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

double WorstSigma(const RegistrationResult& result) {
  // What is left of the place's information when height and heading are free.
  constexpr std::array<int, 2> kPlace{0, 1};
  constexpr std::array<int, 2> kOthers{2, 5};
  constexpr double kLittle = 1e-6;
  const Eigen::Matrix2d place = result.information(kPlace, kPlace);
  const Eigen::Matrix2d mixed = result.information(kPlace, kOthers);
  Eigen::Matrix2d others = result.information(kOthers, kOthers);
  others.diagonal().array() += kLittle;
  const Eigen::Matrix2d left = place - mixed * others.inverse() * mixed.transpose();
  const double least = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(left).eigenvalues()(0);
  return least > 0.0 ? std::min(1.0 / std::sqrt(least), 1e9) : 1e9;
}

RegistrationResult Register(const MapWindow& map,
                            const ScanFeatures& scan,
                            const Pose& T_world_level_start,
                            const PosePrior& prior,
                            const RegistrationOptions& options) {
  const Known known{prior, prior.covariance.inverse(), options.tilt_sigma_rad};
  const FeatureFit features(map, scan, options.features);
  const Alignment found = ReturnAlignment(map, scan, features, known, options)
                              .From(AlignFeatures(features, T_world_level_start, known, options));
  const FeatureEvidence last =
      features.At(found.pose, {options.fine_radius_m, options.fine_reach_m});
  RegistrationResult result;
  result.T_world_level = found.pose;
  result.is_converged = found.is_converged;
  result.information = last.equations.H.selfadjointView<Eigen::Lower>();
  result.matched_columns = last.columns;
  const int mapped = last.mapped_columns + last.mapped_ground;
  const double fit = last.column_fit + last.ground_fit;
  result.fit = mapped < kEnough ? 0.0 : fit / mapped;
  result.column_fit = last.mapped_columns < kEnough ? 1.0 : last.column_fit / last.mapped_columns;
  constexpr double kContradicted = 0.5;
  result.evidence = last.column_fit - kContradicted * (mapped - fit);
  result.column_inliers = Share(last.columns, scan.columns.size());
  result.ground_inliers = Share(last.ground, scan.ground.size());
  return result;
}

RegistrationResult Register(const MapWindow& map,
                            const ScanFeatures& features,
                            const Pose& T_world_level_start,
                            const RegistrationOptions& options) {
  const double translation = options.start_sigma_m * options.start_sigma_m;
  const double rotation = options.start_sigma_rad * options.start_sigma_rad;
  const Eigen::Vector4d variances(translation, translation, translation, rotation);
  return Register(map, features, T_world_level_start, {T_world_level_start, variances.asDiagonal()},
                  options);
}

}  // namespace atlas
