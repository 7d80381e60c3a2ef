#include "core/localization/registration.h"

#include <array>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace atlas {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

// Normal equations of residuals r(t, w) about the current pose: p = R(w) * arm + t.
struct NormalEquations {
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();
  int columns = 0;
  int ground = 0;
  // Of features where the map says something: how many, and the sum of their robust weights.
  int mapped_columns = 0;
  int mapped_ground = 0;
  double column_fit = 0.0;
  double ground_fit = 0.0;

  // Residual along the unit vector `direction` (world) of a point at `arm` from the sensor.
  void Add(const Eigen::Vector3d& direction,
           const Eigen::Vector3d& arm,
           double residual,
           double weight) {
    Vector6d J;
    J.head<3>() = direction;
    J.tail<3>() = arm.cross(direction);
    H.selfadjointView<Eigen::Lower>().rankUpdate(J, weight);
    g += weight * residual * J;
  }
};

// Geman-McClure: a residual of several scales has no say.
double RobustWeight(double residual, double scale) {
  const double ratio = residual / scale;
  const double denominator = 1.0 + ratio * ratio;
  return 1.0 / (denominator * denominator);
}

struct Stage {
  float radius_m;
  float reach_m;
};

class Problem {
 public:
  Problem(const MapWindow& map, const ScanFeatures& features, const RegistrationOptions& options)
      : map_(map), features_(features), options_(options) {}

  NormalEquations Linearize(const Pose& pose, const Stage& stage) const {
    NormalEquations equations;
    const Eigen::Matrix3f R = pose.linear().cast<float>();
    const Eigen::Vector3f t = (pose.translation() - map_.origin()).cast<float>();
    for (const Eigen::Vector3f& p : features_.columns) {
      AddColumn(R * p, t, stage, equations);
    }
    for (const Eigen::Vector3f& p : features_.ground) {
      AddGround(R * p, t, stage, equations);
    }
    return equations;
  }

 private:
  void AddColumn(const Eigen::Vector3f& arm,
                 const Eigen::Vector3f& t,
                 const Stage& stage,
                 NormalEquations& equations) const {
    const Eigen::Vector3f p = arm + t;
    const ColumnLine* line = map_.NearestLine(p, stage.radius_m);
    if (line != nullptr && !line->CanBeSeenFrom(t.head<2>())) {
      line = nullptr;
    }
    equations.mapped_columns += line != nullptr || map_.IsFree(p) ? 1 : 0;
    if (line == nullptr) {
      return;
    }
    const Eigen::Vector2f offset = p.head<2>() - line->center;
    const double along_normal = line->normal.dot(offset);
    const Eigen::Vector2f tangent(-line->normal.y(), line->normal.x());
    const double along_tangent = line->is_wall ? 0.0 : tangent.dot(offset);
    const double scale = 0.4 * stage.radius_m;
    const double robust = RobustWeight(std::hypot(along_normal, along_tangent), scale);
    const double weight = robust / (options_.column_sigma_m * options_.column_sigma_m);
    ++equations.columns;
    equations.column_fit += robust;
    equations.Add({line->normal.x(), line->normal.y(), 0.0}, arm.cast<double>(), along_normal,
                  weight);
    if (!line->is_wall) {
      equations.Add({tangent.x(), tangent.y(), 0.0}, arm.cast<double>(), along_tangent, weight);
    }
  }

  void AddGround(const Eigen::Vector3f& arm,
                 const Eigen::Vector3f& t,
                 const Stage& stage,
                 NormalEquations& equations) const {
    float height_m = 0.0F;
    equations.mapped_ground += map_.IsMapped(arm + t) ? 1 : 0;
    const SurfacePlane* plane = map_.NearestSurface(arm + t, stage.reach_m, &height_m);
    if (plane == nullptr) {
      return;
    }
    const bool is_slope = plane->gradient.norm() >= options_.min_gradient;
    const Eigen::Vector3d normal =
        is_slope ? Eigen::Vector3d(-plane->gradient.x(), -plane->gradient.y(), 1.0).normalized()
                 : Eigen::Vector3d::UnitZ();
    const double residual = height_m * normal.z();
    const double robust = RobustWeight(residual, 0.4 * stage.reach_m);
    const double weight = robust / (options_.ground_sigma_m * options_.ground_sigma_m);
    ++equations.ground;
    equations.ground_fit += robust;
    equations.Add(normal, arm.cast<double>(), residual, weight);
  }

  const MapWindow& map_;
  const ScanFeatures& features_;
  const RegistrationOptions& options_;
};

// The levelled frame is upright within the IMU's error: roll and pitch stay near 0.
void AddTiltPrior(const Pose& pose, double sigma_rad, NormalEquations& equations) {
  const Eigen::Vector3d up = pose.linear().col(2);
  const double weight = 1.0 / (sigma_rad * sigma_rad);
  for (int axis = 3; axis < 5; ++axis) {
    // A rotation w turns the vertical by w x up: about x it moves y by -w.
    const double tilt = axis == 3 ? -up.y() : up.x();
    equations.H(axis, axis) += weight;
    equations.g(axis) += weight * tilt;
  }
}

// Of a pose's (x, y, z, yaw) among the six unknowns.
constexpr std::array<int, 4> kPriorAxes{0, 1, 2, 5};

void AddPrior(const Pose& pose,
              const Pose& expected,
              const Eigen::Matrix4d& information,
              NormalEquations& equations) {
  equations.g(kPriorAxes) += information * PoseDifference(expected, pose);
  equations.H(kPriorAxes, kPriorAxes) += information;
}

Pose Moved(const Pose& pose, const Vector6d& step) {
  Pose moved = pose;
  moved.translation() += step.head<3>();
  const double angle = step.tail<3>().norm();
  if (angle > 0.0) {
    moved.linear() =
        Eigen::AngleAxisd(angle, step.tail<3>() / angle).toRotationMatrix() * pose.linear();
  }
  return moved;
}

// Mapped features that a fit needs.
constexpr int kEnough = 30;

double Share(int part, std::size_t whole) {
  return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

RegistrationResult Register(const MapWindow& map,
                            const ScanFeatures& features,
                            const Pose& T_world_level_start,
                            const PosePrior& prior,
                            const RegistrationOptions& options) {
  const Eigen::Matrix4d prior_information = prior.covariance.inverse();
  const Problem problem(map, features, options);
  const Stage fine{options.fine_radius_m, options.fine_reach_m};
  RegistrationResult result;
  result.T_world_level = T_world_level_start;
  for (int iteration = 0; iteration < options.max_iterations && !result.is_converged; ++iteration) {
    const bool is_coarse = iteration < options.coarse_iterations;
    const float left = is_coarse ? 1.0F - static_cast<float>(iteration) /
                                              static_cast<float>(options.coarse_iterations)
                                 : 0.0F;
    const Stage stage{
        options.fine_radius_m + left * (options.coarse_radius_m - options.fine_radius_m),
        options.fine_reach_m + left * (options.coarse_reach_m - options.fine_reach_m)};
    NormalEquations equations = problem.Linearize(result.T_world_level, stage);
    AddTiltPrior(result.T_world_level, options.tilt_sigma_rad, equations);
    AddPrior(result.T_world_level, prior.T_world_level, prior_information, equations);
    const Matrix6d H = equations.H.selfadjointView<Eigen::Lower>();
    const Vector6d step = H.ldlt().solve(-equations.g);
    result.T_world_level = Moved(result.T_world_level, step);
    result.is_converged = !is_coarse && step.head<3>().norm() < options.converged_m &&
                          step.tail<3>().norm() < options.converged_rad;
  }
  const NormalEquations last = problem.Linearize(result.T_world_level, fine);
  result.information = last.H.selfadjointView<Eigen::Lower>();
  result.matched_columns = last.columns;
  const int mapped = last.mapped_columns + last.mapped_ground;
  const double fit = last.column_fit + last.ground_fit;
  result.fit = mapped < kEnough ? 0.0 : fit / mapped;
  result.column_fit = last.mapped_columns < kEnough ? 1.0 : last.column_fit / last.mapped_columns;
  constexpr double kContradicted = 0.5;
  result.evidence = last.column_fit - kContradicted * (mapped - fit);
  result.column_inliers = Share(last.columns, features.columns.size());
  result.ground_inliers = Share(last.ground, features.ground.size());
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
