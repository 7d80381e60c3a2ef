#include "core/fusion/observation/keyframe_placement.h"

#include <cmath>

#include "core/base/integer_math.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr int kWideBits = 60;  // fraction bits of intermediate rotations
constexpr std::int64_t kOne = std::int64_t{1} << kWideBits;
constexpr std::int64_t kCosMaxTilt = 1'152'219'175'977'136'986;  // floor(cos 2 deg * 2^60)

// w x y z x 2^60.
using WideQuaternion = std::array<std::int64_t, 4>;

// floor(sqrt(value)) for value < 2^124.
std::int64_t WideSqrt(Int128 value) {
  std::int64_t root = 0;
  for (std::int64_t bit = std::int64_t{1} << 61; bit != 0; bit >>= 1) {
    const std::int64_t next = root + bit;
    root = Int128{next} * next <= value ? next : root;
  }
  return root;
}

Int128 Product(std::int64_t a, std::int64_t b) {
  return Int128{a} * b;
}

// a * conj(b); both of about unit length x 2^30, so that no component leaves 64 bits.
WideQuaternion TimesConjugate(const std::array<std::int32_t, 4>& a,
                              const std::array<std::int32_t, 4>& b) {
  const std::int64_t aw = a[0], ax = a[1], ay = a[2], az = a[3];
  const std::int64_t bw = b[0], bx = -std::int64_t{b[1]}, by = -std::int64_t{b[2]},
                     bz = -std::int64_t{b[3]};
  return {aw * bw - ax * bx - ay * by - az * bz, aw * bx + ax * bw + ay * bz - az * by,
          aw * by - ax * bz + ay * bw + az * bx, aw * bz + ax * by - ay * bx + az * bw};
}

// The five elements of the rotation matrix that placement needs, x 2^60.
struct RotationPart {
  std::int64_t m00 = 0, m10 = 0;           // where the levelled x axis points on the map
  std::int64_t m20 = 0, m21 = 0, m22 = 0;  // world z per levelled x, y, z
};

// value / norm x 2^60, both x 2^120: norm is about 2^120, so 2^60 of it may be divided away first.
std::int64_t Normalized(Int128 value, Int128 norm) {
  return RoundDiv128(value, static_cast<std::int64_t>(norm >> kWideBits));
}

RotationPart ToRotation(const WideQuaternion& q) {
  const auto [w, x, y, z] = q;
  const Int128 ww = Product(w, w), xx = Product(x, x), yy = Product(y, y), zz = Product(z, z);
  const Int128 norm = ww + xx + yy + zz;
  RotationPart m;
  m.m00 = Normalized(ww + xx - yy - zz, norm);
  m.m10 = Normalized(2 * (Product(x, y) + Product(w, z)), norm);
  m.m20 = Normalized(2 * (Product(x, z) - Product(w, y)), norm);
  m.m21 = Normalized(2 * (Product(y, z) + Product(w, x)), norm);
  m.m22 = Normalized(ww - xx - yy + zz, norm);
  return m;
}

// value x 2^60 -> x 2^30, to nearest.
std::int32_t Narrow(std::int64_t value) {
  return static_cast<std::int32_t>(
      RoundDiv(value, std::int64_t{1} << (kWideBits - KeyframePlacement::kBits)));
}

// Lengths within 1 % of one; what a pose or a keyframe is accepted with is closer by far.
bool IsNearUnit(const std::array<std::int32_t, 4>& quaternion) {
  std::int64_t squared = 0;
  for (const std::int32_t part : quaternion) {
    const std::int64_t quarter = part / 2;
    squared += quarter * quarter;
  }
  return std::abs(squared - kOne / 4) <= kOne / 200;
}

}  // namespace

Result<KeyframePlacement> PlaceKeyframe(const QuantizedPose& T_world_sensor,
                                        const std::array<std::int32_t, 4>& level_quaternion) {
  if (!IsNearUnit(T_world_sensor.quaternion) || !IsNearUnit(level_quaternion)) {
    return Error(StatusCode::kInvalidData, "keyframe placement: a quaternion's length is not 1");
  }
  const RotationPart m = ToRotation(TimesConjugate(T_world_sensor.quaternion, level_quaternion));
  if (m.m22 < kCosMaxTilt) {
    const double tilt_deg = std::acos(static_cast<double>(m.m22) / static_cast<double>(kOne)) *
                            180.0 / 3.14159265358979;
    return Error(StatusCode::kInvalidData,
                 StrCat("keyframe placement: pose is tilted by ", tilt_deg,
                        " deg against the keyframe's level, at most 2: look at roll and pitch of "
                        "the drive's poses, upload it levelled, or retract its session"));
  }
  const std::int64_t norm = WideSqrt(Product(m.m00, m.m00) + Product(m.m10, m.m10));
  KeyframePlacement placement;
  placement.x_um = T_world_sensor.x_um;
  placement.y_um = T_world_sensor.y_um;
  placement.z_um = T_world_sensor.z_um;
  constexpr std::int64_t kUnit = std::int64_t{1} << KeyframePlacement::kBits;
  placement.cos_yaw = static_cast<std::int32_t>(RoundDiv128(Product(m.m00, kUnit), norm));
  placement.sin_yaw = static_cast<std::int32_t>(RoundDiv128(Product(m.m10, kUnit), norm));
  placement.slope_x = Narrow(m.m20);
  placement.slope_y = Narrow(m.m21);
  return placement;
}

}  // namespace atlas
