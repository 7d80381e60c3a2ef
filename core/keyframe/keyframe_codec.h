// The keyframe blob (docs/formats/keyframe.md): encoded once on the vehicle, stored and fused as
// is.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/bytes.h"
#include "core/base/status.h"
#include "core/geometry/map_profile.h"
#include "core/keyframe/keyframe.h"

namespace atlas {

// What the first bytes say, without decompressing anything.
struct KeyframeHeader {
  std::uint64_t profile_hash = 0;
  GridGeometry grid;
  std::array<std::int32_t, 4> level_quaternion{};
  std::int32_t sensor_height_mm = 0;
};

inline constexpr std::size_t kMaxKeyframeBytes = 16u << 20;

// Requires a keyframe that ValidateKeyframe accepts; equal keyframes give equal bytes.
Bytes EncodeKeyframe(const Keyframe& keyframe);

// Checks magic, version, sizes and limits. kUnsupported on a newer version, kInvalidData otherwise.
Result<KeyframeHeader> ReadKeyframeHeader(ByteSpan blob);

// Also verifies the checksum and every value. kInvalidData on damage.
Result<Keyframe> DecodeKeyframe(ByteSpan blob);

// The header of a blob that DecodeKeyframe would take, and its errors for others, in a fifth of the
// time: no keyframe is made.
Result<KeyframeHeader> CheckKeyframe(ByteSpan blob);

// kInvalidData when the keyframe was made for another profile than `profile`.
Status CheckKeyframeProfile(const KeyframeHeader& header, const MapProfile& profile);

}  // namespace atlas
