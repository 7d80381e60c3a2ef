// Between Protobuf messages and the types of core/geometry. Everything that comes from the wire is
// checked here, so that nothing behind this header meets an invalid key or pose.
#pragma once

#include <string>

#include "core/geometry/keyframe_key.h"
#include "core/geometry/map_profile.h"
#include "core/geometry/pose.h"
#include "proto/wire/envelope.h"

namespace atlas {

wire::KeyframeKey KeyToWire(const KeyframeKey& key);
// kInvalidArgument on a name that is none.
Result<KeyframeKey> KeyFromWire(const wire::KeyframeKey& message);

wire::Pose PoseToWire(const QuantizedPose& pose);
// kInvalidData on a quaternion that is not one or a position out of range.
Result<QuantizedPose> PoseFromWire(const wire::Pose& message);

std::string ProfileToWire(const MapProfile& profile);
Result<MapProfile> ProfileFromWire(const std::string& bytes);

ByteSpan BytesFromWire(const std::string& bytes);
std::string BytesToWire(ByteSpan bytes);

// An error reply. `retry` follows from the code: unavailable, timeout and resource_exhausted may
// succeed later, after what the status says, up to what fits, or else what is usual for the code.
wire::Error ErrorToWire(const Status& status);

// An error as its receiver sees it.
struct RemoteError {
  Status status;  // never ok: an unknown code becomes kInternal; with the wait that it asks for
  bool retry = false;
};
RemoteError ErrorFromWire(const wire::Error& message);

}  // namespace atlas
