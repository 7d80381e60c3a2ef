#include "core/localization/odometry/scan_odometry.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "core/localization/icp/point_index.h"
#include "core/localization/odometry/upright_columns.h"
#include "core/localization/registration/normal_equations.h"

namespace atlas {
namespace {

// Geman-McClure, as of a scan in a map.
float RobustWeight(float residual, float reach) {
  constexpr float kScale = 0.4F;
  const float ratio = residual / (kScale * reach);
  const float denominator = 1.0F + ratio * ratio;
  return 1.0F / (denominator * denominator);
}

// What a cloud is around one of its points.
struct Neighbourhood {
  Eigen::Vector3f center = Eigen::Vector3f::Zero();
  Eigen::Matrix3f covariance = Eigen::Matrix3f::Zero();
  std::size_t points = 0;
};

class Cloud {
 public:
  Cloud(std::vector<Eigen::Vector3f> points, float radius_m)
      : index_(std::move(points)), radius_m_(radius_m), known_(index_.points().size()) {}

  // Around the point that is nearest to `p`.
  const Neighbourhood* Near(const Eigen::Vector3f& p, float reach_m) {
    const std::optional<NearPoint> nearest = index_.Nearest(p, reach_m);
    if (!nearest) {
      return nullptr;
    }
    std::optional<Neighbourhood>& known = known_[nearest->index];
    if (!known) known = Around(index_.points()[nearest->index]);
    return &*known;
  }

 private:
  Neighbourhood Around(const Eigen::Vector3f& p) {
    constexpr std::size_t kNeighbours = 12;
    index_.Nearest(p, radius_m_, kNeighbours, near_);
    Neighbourhood around;
    around.points = near_.size();
    for (const NearPoint& point : near_) around.center += index_.points()[point.index];
    around.center /= static_cast<float>(near_.size());
    for (const NearPoint& point : near_) {
      const Eigen::Vector3f offset = index_.points()[point.index] - around.center;
      around.covariance += offset * offset.transpose();
    }
    return around;
  }

  PointIndex index_;
  float radius_m_;
  std::vector<std::optional<Neighbourhood>> known_;
  std::vector<NearPoint> near_;
};

// The fit of one scan to those before.
class ScanFit {
 public:
  ScanFit(const RecentScans& recent,
          const ScanFeatures& features,
          const Eigen::Vector3d& origin,
          const ScanOdometryOptions& options)
      : options_(options),
        scan_columns_(UprightColumns(features.columns)),
        scan_ground_(features.ground),
        columns_(UprightColumns(recent.Columns(origin)), 0.8F),
        ground_(recent.Ground(origin), 2.5F) {}

  // Of features: how many, and the sum of their robust weights.
  struct Share {
    int features = 0;
    double fit = 0.0;

    void Add(double weight) {
      ++features;
      fit += weight;
    }
    double mean() const { return features == 0 ? 0.0 : fit / features; }
  };
  struct Evidence {
    NormalEquations equations;
    Share near_columns;
    Share columns;
    Share near_ground;

    // Ground fits wherever there is some: it counts where nothing stands.
    double Fit(const ScanOdometryOptions& options) const {
      if (near_columns.features >= options.few_columns) return near_columns.mean();
      return columns.features >= options.few_columns
                 ? std::min(1.0, columns.mean() / options.far_known)
                 : near_ground.mean();
    }
  };

  Evidence At(const Pose& pose, float reach_m) {
    Evidence evidence;
    const Eigen::Matrix3f R = pose.linear().cast<float>();
    const Eigen::Vector3f t = pose.translation().cast<float>();
    for (const Eigen::Vector3f& p : scan_columns_) {
      const double weight{AddColumn(R * p, t, reach_m, evidence.equations)};
      evidence.columns.Add(weight);
      if (IsNear(p)) evidence.near_columns.Add(weight);
    }
    for (const Eigen::Vector3f& p : scan_ground_) {
      const double weight{AddGround(R * p, t, reach_m, evidence.equations)};
      if (IsNear(p)) evidence.near_ground.Add(weight);
    }
    return evidence;
  }

 private:
  bool IsNear(const Eigen::Vector3f& p) const { return p.norm() <= options_.max_range_m; }

  // A wall's line holds across itself, what is no wall in both directions. Its robust weight; 0
  // where nothing is near.
  float AddColumn(const Eigen::Vector3f& arm,
                  const Eigen::Vector3f& t,
                  float reach_m,
                  NormalEquations& equations) {
    constexpr float kWall = 0.1F;  // of its spread along, across
    constexpr std::size_t kFewest = 4;
    const Neighbourhood* near = columns_.Near(arm + t, reach_m);
    if (near == nullptr || near->points < kFewest) {
      return 0.0F;
    }
    const Eigen::Vector2f offset = (arm + t - near->center).head<2>();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2f> spread(
        near->covariance.topLeftCorner<2, 2>());
    const bool is_wall = spread.eigenvalues()(0) < kWall * spread.eigenvalues()(1);
    const Eigen::Vector2f normal = spread.eigenvectors().col(0);
    const float residual = is_wall ? std::abs(normal.dot(offset)) : offset.norm();
    const float robust = RobustWeight(residual, reach_m);
    const double weight = robust / (options_.column_sigma_m * options_.column_sigma_m);
    if (is_wall) {
      AddAlong(normal, arm, normal.dot(offset), weight, equations);
    } else {
      AddAlong(Eigen::Vector2f::UnitX(), arm, offset.x(), weight, equations);
      AddAlong(Eigen::Vector2f::UnitY(), arm, offset.y(), weight, equations);
    }
    return robust;
  }

  static void AddAlong(const Eigen::Vector2f& direction,
                       const Eigen::Vector3f& arm,
                       float residual,
                       double weight,
                       NormalEquations& equations) {
    equations.Add({double{direction.x()}, double{direction.y()}, 0.0}, arm.cast<double>(),
                  double{residual}, weight);
  }

  // Holds height and tilt alone: it is seen along rings around the sensor, which lie best on those
  // before where it stands still.
  float AddGround(const Eigen::Vector3f& arm,
                  const Eigen::Vector3f& t,
                  float reach_m,
                  NormalEquations& equations) {
    constexpr float kSteepest = 0.8F;  // cosine: more is no ground
    constexpr std::size_t kFewest = 5;
    constexpr float kNeighbour_m = 1.5F;
    const Neighbourhood* near = ground_.Near(arm + t, kNeighbour_m);
    if (near == nullptr || near->points < kFewest) {
      return 0.0F;
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> spread(near->covariance);
    const Eigen::Vector3f normal = spread.eigenvectors().col(0);
    if (std::abs(normal.z()) < kSteepest) {
      return 0.0F;
    }
    const float residual = normal.dot(arm + t - near->center);
    const float robust = RobustWeight(std::abs(residual), 0.5F * reach_m);
    equations.Add({0.0, 0.0, double{normal.z()}}, arm.cast<double>(), double{residual},
                  robust / (options_.ground_sigma_m * options_.ground_sigma_m));
    return robust;
  }

  const ScanOdometryOptions& options_;
  const std::vector<Eigen::Vector3f> scan_columns_;
  const std::vector<Eigen::Vector3f>& scan_ground_;
  Cloud columns_;
  Cloud ground_;
};

Eigen::Vector4d Squares(double horizontal, double up, double turn) {
  return Eigen::Vector4d(horizontal, horizontal, up, turn).cwiseAbs2();
}

// What the scan leaves uncertain: where it holds nothing, all. What was expected is no part of it.
PoseCovariance UncertaintyOf(const NormalEquations& equations, double information_share) {
  constexpr std::array<int, 4> kAxes{0, 1, 2, 5};
  constexpr double kNothing = 1e-4;  // of 100 m, or as many radians
  const NormalEquations::Matrix6 information = equations.H.selfadjointView<Eigen::Lower>();
  Eigen::Matrix4d held = information_share * information(kAxes, kAxes);
  held.diagonal().array() += kNothing;
  return held.inverse();
}

struct Start {
  Pose pose;
  Pose expected;  // where the scan lies as far as nothing else holds it
};

// Downhill.
Pose Descend(ScanFit& scan, const Start& start, const ScanOdometryOptions& options) {
  const Eigen::Matrix4d information =
      Squares(options.start_sigma_m, options.start_sigma_m, options.start_sigma_rad)
          .cwiseInverse()
          .asDiagonal();
  Pose pose = start.pose;
  for (int i = 0; i < options.iterations + options.fine_iterations; ++i) {
    const float left =
        std::max(0.0F, 1.0F - static_cast<float>(i) / static_cast<float>(options.iterations));
    const float reach_m =
        options.fine_reach_m + left * (options.coarse_reach_m - options.fine_reach_m);
    NormalEquations equations = scan.At(pose, reach_m).equations;
    equations.AddTiltPrior(pose, options.tilt_sigma_rad);
    equations.AddPrior(pose, start.expected, information);
    pose = Moved(pose, equations.Solve());
  }
  return pose;
}

Pose Turned(Pose pose, double angle_rad) {
  pose.linear() =
      Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix() * pose.linear();
  return pose;
}

// As expected, then turned, the least first.
std::vector<Start> TurnedStarts(const Pose& expected, const ScanOdometryOptions& options) {
  std::vector<Start> starts{{expected, expected}};
  for (int step = 1; step <= options.turns; ++step) {
    for (const double side : {-1.0, 1.0}) {
      starts.push_back({Turned(expected, side * step * options.turn_rad), expected});
    }
  }
  return starts;
}

// Of a vehicle of whose motion little is known.
std::vector<Start> FannedStarts(const Pose& expected,
                                const HorizontalSpread& spread,
                                const ScanOdometryOptions& options) {
  const int steps = static_cast<int>(options.fan_sigmas * spread.along_m / options.fan_step_m);
  std::vector<Start> starts;
  for (int step = -steps; step <= steps; ++step) {
    Pose start = expected;
    start.translation().head<2>() += step * options.fan_step_m * spread.direction;
    starts.push_back({start, start});
  }
  return starts;
}

// ... and that may turn besides: those that fit best, for to try them all takes a second.
std::vector<Start> FannedTurns(const std::vector<Start>& fanned,
                               ScanFit& scan,
                               const ScanOdometryOptions& options) {
  struct Looked {
    double fit;
    Start start;
  };
  std::vector<Looked> looked;
  for (const Start& start : fanned) {
    for (const Start& turned : TurnedStarts(start.pose, options)) {
      const Start free{turned.pose, turned.pose};
      const double fit = scan.At(free.pose, options.coarse_reach_m).Fit(options);
      looked.push_back({fit, free});
    }
  }
  std::stable_sort(looked.begin(), looked.end(),
                   [](const Looked& a, const Looked& b) { return a.fit > b.fit; });
  std::vector<Start> starts;
  for (std::size_t i = 0; i < std::min(looked.size(), options.fanned_turns); ++i) {
    starts.push_back(looked[i].start);
  }
  return starts;
}

// The best of where these lead.
class BestMotion {
 public:
  BestMotion(ScanFit& scan, const ScanOdometryOptions& options) : scan_(scan), options_(options) {}

  void Try(const Start& start) {
    const Pose pose = Descend(scan_, start, options_);
    const ScanFit::Evidence evidence = scan_.At(pose, options_.fine_reach_m);
    const double fit = evidence.Fit(options_);
    tried_.push_back({pose, fit});
    if (fit > motion_.fit) {
      motion_.T_world_level = pose;
      motion_.covariance = UncertaintyOf(evidence.equations, options_.information_share);
      motion_.fit = fit;
    }
  }
  bool is_sure() const { return motion_.fit >= options_.sure_fit; }
  // As uncertain as others that fit as well are far from it.
  ScanMotion Motion() const {
    ScanMotion motion = motion_;
    Eigen::Vector4d furthest = Eigen::Vector4d::Zero();
    for (const Tried& tried : tried_) {
      const Eigen::Vector4d off = PoseDifference(motion.T_world_level, tried.pose);
      const double off_m = off.head<2>().norm();
      if (off_m > options_.clear_m && tried.fit >= options_.clear_share * motion.fit) {
        motion.is_clear = false;
      }
      if (off_m > furthest.head<2>().norm() && tried.fit >= motion.fit - options_.as_good_fit) {
        furthest = off;
      }
    }
    motion.covariance += furthest * furthest.transpose();
    return motion;
  }

 private:
  struct Tried {
    Pose pose;
    double fit;
  };

  ScanFit& scan_;
  const ScanOdometryOptions& options_;
  ScanMotion motion_;
  std::vector<Tried> tried_;
};

}  // namespace

ScanMotion MotionSince(const RecentScans& recent,
                       const ScanFeatures& features,
                       const PosePrior& expected,
                       const ScanOdometryOptions& options) {
  const Eigen::Vector3d origin = expected.T_world_level.translation();
  Pose here = expected.T_world_level;
  here.translation().setZero();
  ScanFit scan(recent, features, origin, options);
  BestMotion best(scan, options);
  const HorizontalSpread spread = SpreadOf(expected.covariance);
  if (spread.along_m > options.fan_sigma_m) {
    const std::vector<Start> fanned = FannedStarts(here, spread, options);
    for (const Start& start : fanned) best.Try(start);
    if (!best.is_sure()) {
      for (const Start& start : FannedTurns(fanned, scan, options)) best.Try(start);
    }
  } else {
    for (const Start& start : TurnedStarts(here, options)) {
      best.Try(start);
      if (best.is_sure()) break;
    }
  }
  ScanMotion motion = best.Motion();
  motion.T_world_level.translation() += origin;
  return motion;
}

}  // namespace atlas
