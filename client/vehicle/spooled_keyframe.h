// A keyframe as it waits on the vehicle's disk (docs/formats/vehicle.md).
#pragma once

#include <cstdint>
#include <optional>

#include "client/connection/requests.h"
#include "core/base/bytes.h"
#include "core/base/status.h"

namespace atlas {

struct SpooledKeyframe {
  KeyframeKey key;
  std::int64_t time_ms = 0;
  QuantizedPose T_world_sensor;
  Bytes blob;
  bool is_staged = false;
  std::optional<KnownPosition> prior = std::nullopt;

  KeyframeUpload ToUpload() const { return {key, time_ms, T_world_sensor, blob, is_staged, prior}; }
};

// No spooled keyframe takes more.
inline constexpr std::uint64_t kMaxSpooledBytes = (std::uint64_t{16} << 20) + 1024;

// Without a prior as programs read it that know of none.
Bytes EncodeSpooled(const KeyframeUpload& upload);
// kInvalidData: truncated, damaged or something else.
Result<SpooledKeyframe> DecodeSpooled(ByteSpan file);

}  // namespace atlas
