#include "tests/client/merge/plan/blind_session.h"

#include <stdexcept>
#include <utility>

#include "client/merge/plan/submap_builder.h"
#include "core/base/hash.h"
#include "core/keyframe/keyframe_codec.h"
#include "tests/core/support/keyframe_worlds.h"

namespace atlas::testing {

Pose At(double x_m, double y_m, double z_m, double yaw_rad) {
  Pose pose = Pose::Identity();
  pose.translation() = Eigen::Vector3d(x_m, y_m, z_m);
  pose.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return pose;
}

std::vector<Pose> Straight(const Pose& start, std::size_t count, double step_m) {
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < count; ++i) {
    poses.push_back(start * At(step_m * static_cast<double>(i)));
  }
  return poses;
}

MergeWork& SharedWork() {
  static MergeWork work = MergeWork::Temporary().value();
  return work;
}

MergeSession BlindSession(const std::string& vehicle,
                          const std::vector<Pose>& T_world_sensor,
                          const MergeOptions& options) {
  MergeSession session;
  session.key = {vehicle, "drive"};
  for (const Pose& pose : T_world_sensor) {
    const auto sequence = static_cast<std::uint32_t>(session.keyframes.size());
    session.keyframes.push_back({sequence, 250 * static_cast<std::int64_t>(sequence),
                                 QuantizedPose::FromPose(pose), std::nullopt});
  }
  const MapProfile profile;
  static std::int32_t made = 0;  // no two are the same session
  Keyframe blank = BlankKeyframe(profile, 4);
  blank.sensor_height_mm = 1'000 + made++;
  const Bytes blob = EncodeKeyframe(blank);
  for (MergeKeyframe& keyframe : session.keyframes) keyframe.blob_hash = Hash64(blob);
  const Status built = BuildSubmaps(
      session, StoredPoses(session), [&](std::size_t) -> Result<Bytes> { return blob; },
      {profile, options, SharedWork()}, {}, nullptr);
  if (!built.ok()) throw std::runtime_error(built.message());
  return session;
}

MergeSession Staged(MergeSession session) {
  session.is_staged = true;
  return session;
}

FoundClosure Found(const SubmapRef& a, const SubmapRef& b, const Pose& T_a_b, double explained) {
  FoundClosure closure{a, b, {}};
  closure.match.T_a_b = T_a_b;
  closure.match.information = 1e8 * Eigen::Matrix<double, 6, 6>::Identity();
  closure.match.explained = explained;
  return closure;
}

FoundClosure FoundAsStored(const std::vector<MergeSession>& sessions,
                           const SubmapRef& a,
                           const SubmapRef& b,
                           const Pose& off) {
  const Pose T_world_a = StoredPose(sessions[a.session], atlas::At(sessions, a));
  const Pose T_world_b = StoredPose(sessions[b.session], atlas::At(sessions, b));
  return Found(a, b, off * (T_world_a.inverse() * T_world_b));
}

double DistanceBetween(const Pose& pose, const Pose& expected) {
  return (pose.translation() - expected.translation()).norm();
}

double AngleBetween(const Pose& pose, const Pose& expected) {
  return Eigen::AngleAxisd(Eigen::Matrix3d(expected.linear().transpose() * pose.linear())).angle();
}

}  // namespace atlas::testing
