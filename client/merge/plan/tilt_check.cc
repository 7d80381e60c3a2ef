#include "client/merge/plan/tilt_check.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <numbers>
#include <sstream>

#include "core/base/str_cat.h"
#include "core/fusion/observation/keyframe_placement.h"

namespace atlas {
namespace {

// Between what is up in the levelled grid and what is up in the world.
double AngleOf(const Pose& T_world_sensor, const std::array<std::int32_t, 4>& level) {
  const Eigen::Quaterniond R_level_sensor(
      Eigen::Vector4d(level[1], level[2], level[3], level[0]).normalized());
  const Eigen::Vector3d up =
      T_world_sensor.linear() * (R_level_sensor.inverse() * Eigen::Vector3d::UnitZ());
  return std::atan2(up.head<2>().norm(), up.z());
}

// "3, 7 to 12, 30": runs of sequences that follow each other, the first few of them.
std::string RunsOf(const std::vector<std::uint32_t>& sequences) {
  constexpr std::size_t kMost = 6;
  std::string text;
  std::size_t runs = 0;
  for (std::size_t first = 0; first < sequences.size(); ++runs) {
    if (runs == kMost) return text + ", ...";
    std::size_t last = first;
    while (last + 1 < sequences.size() && sequences[last + 1] == sequences[last] + 1) ++last;
    text += StrCat(text.empty() ? "" : ", ", sequences[first]);
    if (last > first) text += StrCat(" to ", sequences[last]);
    first = last + 1;
  }
  return text;
}

}  // namespace

std::string SessionTilt::Message() const {
  std::ostringstream degrees;
  degrees << std::fixed << std::setprecision(2) << max_rad * 180.0 / std::numbers::pi;
  return StrCat(
      "keyframe ", RunsOf(too_far), ": would be tilted by up to ", degrees.str(),
      " degrees against the levelled grid, 2 at most; what it was merged with is levelled "
      "otherwise: look at roll and pitch of its drive, upload that again, or retract it");
}

Result<SessionTilt> TiltOf(const MergeSession& session,
                           const std::vector<Pose>& T_world_sensor,
                           const HeaderReader& read) {
  SessionTilt tilt;
  double squares_rad2 = 0.0;
  for (std::size_t i = 0; i < session.keyframes.size(); ++i) {
    const auto header = read(i);
    if (!header) return Error(header.error());
    const double angle_rad = AngleOf(T_world_sensor[i], header->level_quaternion);
    squares_rad2 += angle_rad * angle_rad;
    tilt.max_rad = std::max(tilt.max_rad, angle_rad);
    if (!PlaceKeyframe(QuantizedPose::FromPose(T_world_sensor[i]), header->level_quaternion)) {
      tilt.too_far.push_back(session.keyframes[i].sequence);
    }
  }
  const auto count = static_cast<double>(std::max<std::size_t>(session.keyframes.size(), 1));
  tilt.rms_rad = std::sqrt(squares_rad2 / count);
  return tilt;
}

}  // namespace atlas
