// One walk over the poses.
#include "core/simulation/trajectory.h"

#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr double kNode_m = 1.0;

class Walk {
 public:
  explicit Walk(const TrajectoryOptions& options) : options_(options) {}

  void Step(const Pose& pose) {
    const Eigen::Vector3d& p = pose.translation();
    if (trajectory_.legs.empty() || (p - last_).norm() > options_.jump_m) {
      BeginLeg(p);
    }
    last_ = p;
    std::vector<Eigen::Vector3d>& nodes = trajectory_.legs.back();
    const double step_m = (p - nodes.back()).head<2>().norm();
    if (step_m >= kNode_m) {
      nodes.push_back(p);
      along_m_ += step_m;
    }
    if (leg_steps_ == 0.0 || (p - kept_).norm() >= options_.every_m) {
      kept_ = p;
      const double beyond_m = (p - nodes.back()).head<2>().norm();
      trajectory_.moments.push_back({pose, trajectory_.legs.size() - 1,
                                     leg_steps_ * options_.interval_s, along_m_ + beyond_m});
    }
    leg_steps_ += 1.0;
  }

  Trajectory Take() { return std::move(trajectory_); }

 private:
  void BeginLeg(const Eigen::Vector3d& p) {
    trajectory_.legs.push_back({p});
    along_m_ = 0.0;
    leg_steps_ = 0.0;
  }

  const TrajectoryOptions& options_;
  Trajectory trajectory_;
  Eigen::Vector3d last_ = Eigen::Vector3d::Zero();  // once a leg has begun, as is the next
  Eigen::Vector3d kept_ = Eigen::Vector3d::Zero();
  double along_m_ = 0.0;
  double leg_steps_ = 0.0;
};

}  // namespace

Result<Trajectory> PlanTrajectory(std::span<const Pose> poses, const TrajectoryOptions& options) {
  if (!(options.every_m >= 0.0 && options.every_m <= 1000.0)) {
    return Error(StatusCode::kInvalidArgument,
                 StrCat("every ", options.every_m, " m: expected 0 to 1000"));
  }
  if (poses.empty()) {
    return Error(StatusCode::kInvalidData, "a trajectory without a pose");
  }
  Walk walk(options);
  for (const Pose& pose : poses) {
    walk.Step(pose);
  }
  return walk.Take();
}

std::vector<DrivePath> GroundBelow(const Trajectory& trajectory, double sensor_height_m) {
  std::vector<DrivePath> legs;
  for (std::vector<Eigen::Vector3d> points : trajectory.legs) {
    for (Eigen::Vector3d& point : points) {
      point.z() -= sensor_height_m;
    }
    legs.push_back(DrivePath::Through(points));
  }
  return legs;
}

}  // namespace atlas
