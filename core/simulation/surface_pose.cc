// Plumb lines under the wheels.
#include "core/simulation/surface_pose.h"

#include <array>

#include "core/base/str_cat.h"
#include "core/simulation/worlds/props.h"

namespace atlas {
namespace {

// Wheels of a small car, seen from its middle.
constexpr double kHalfWheelbase_m = 1.35;
constexpr double kHalfTrack_m = 0.75;
// The surface is looked for from this far above the path down to this far below that.
constexpr double kLookFrom_m = 1.2;
constexpr float kLookDown_m = 2.4F;

// Front left, front right, rear left, rear right.
Result<std::array<Eigen::Vector3d, 4>> WheelContacts(const WorldParts& still, const PathPoint& at) {
  const Eigen::Isometry3d frame = FrameAt(at);
  std::array<Eigen::Vector3d, 4> contacts;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const double x = i < 2 ? kHalfWheelbase_m : -kHalfWheelbase_m;
    const double y = i % 2 == 0 ? kHalfTrack_m : -kHalfTrack_m;
    auto contact = SurfaceNear(still, frame * Eigen::Vector3d(x, y, 0.0));
    if (!contact) {
      return Error(contact.error());
    }
    contacts[i] = *contact;
  }
  return contacts;
}

}  // namespace

Result<Eigen::Vector3d> SurfaceNear(const WorldParts& still, const Eigen::Vector3d& p_world) {
  const Eigen::Vector3d from = p_world + Eigen::Vector3d(0.0, 0.0, kLookFrom_m);
  const WorldHit hit = CastWorld(still, from, -Eigen::Vector3f::UnitZ(), kLookDown_m);
  if (!hit.is_hit()) {
    return Error(StatusCode::kInternal, StrCat("no surface below (", p_world.x(), ", ", p_world.y(),
                                               ", ", p_world.z(), ") m"));
  }
  return Eigen::Vector3d(p_world.x(), p_world.y(),
                         from.z() - static_cast<double>(hit.hit.distance_m));
}

Result<Pose> PoseOnSurface(const WorldParts& still, const PathPoint& at, double height_m) {
  const auto ground = SurfaceNear(still, at.position);
  const auto wheels = WheelContacts(still, at);
  if (!ground || !wheels) {
    return Error(ground ? wheels.error() : ground.error());
  }
  const auto& [front_left, front_right, rear_left, rear_right] = *wheels;
  const Eigen::Vector3d x = (front_left + front_right - rear_left - rear_right).normalized();
  const Eigen::Vector3d across = front_left + rear_left - front_right - rear_right;
  const Eigen::Vector3d z = x.cross(across).normalized();
  Pose pose = Pose::Identity();
  pose.linear().col(0) = x;
  pose.linear().col(1) = z.cross(x);
  pose.linear().col(2) = z;
  pose.translation() = *ground + Eigen::Vector3d(0.0, 0.0, height_m);
  return pose;
}

}  // namespace atlas
