#include "proto/wire/convert.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace atlas {
namespace {

// How long to wait before the same request may succeed; 0: do not retry.
std::uint32_t RetryAfterMs(const Status& status) {
  if (!IsTemporary(status.code())) {
    return 0;
  }
  if (const auto asked_ms = status.retry_after_ms()) {
    constexpr std::int64_t kMost = std::numeric_limits<std::uint32_t>::max();
    return static_cast<std::uint32_t>(std::clamp<std::int64_t>(*asked_ms, 0, kMost));
  }
  const bool is_full = status.code() == StatusCode::kResourceExhausted;
  return is_full ? 5'000 : 1'000;  // someone must make room first
}

}  // namespace

wire::KeyframeKey KeyToWire(const KeyframeKey& key) {
  wire::KeyframeKey message;
  message.set_vehicle(key.session.vehicle);
  message.set_session(key.session.session);
  message.set_sequence(key.sequence);
  return message;
}

Result<KeyframeKey> KeyFromWire(const wire::KeyframeKey& message) {
  Status status = ValidateName("vehicle", message.vehicle());  // as they are: they may be long
  if (status.ok()) {
    status = ValidateName("session", message.session());
  }
  if (!status.ok()) {
    return Error(std::move(status));
  }
  return KeyframeKey{{message.vehicle(), message.session()}, message.sequence()};
}

wire::Pose PoseToWire(const QuantizedPose& pose) {
  wire::Pose message;
  message.set_x_um(pose.x_um);
  message.set_y_um(pose.y_um);
  message.set_z_um(pose.z_um);
  message.set_qw(pose.quaternion[0]);
  message.set_qx(pose.quaternion[1]);
  message.set_qy(pose.quaternion[2]);
  message.set_qz(pose.quaternion[3]);
  return message;
}

Result<QuantizedPose> PoseFromWire(const wire::Pose& message) {
  QuantizedPose pose;
  pose.x_um = message.x_um();
  pose.y_um = message.y_um();
  pose.z_um = message.z_um();
  pose.quaternion = {message.qw(), message.qx(), message.qy(), message.qz()};
  if (Status status = pose.Validate(); !status.ok()) {
    return Error(std::move(status));
  }
  return pose;
}

std::string ProfileToWire(const MapProfile& profile) {
  return BytesToWire(profile.Encode());
}

Result<MapProfile> ProfileFromWire(const std::string& bytes) {
  return MapProfile::Decode(BytesFromWire(bytes));
}

ByteSpan BytesFromWire(const std::string& bytes) {
  // Protobuf's bytes are std::string: the same memory, seen as bytes.
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}

std::string BytesToWire(ByteSpan bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

wire::Error ErrorToWire(const Status& status) {
  wire::Error message;
  message.set_code(static_cast<int>(status.code()));
  message.set_message(status.message());
  message.set_retry_after_ms(RetryAfterMs(status));
  message.set_retry(IsTemporary(status.code()));
  message.set_reason(std::string(StatusReasonName(status.reason())));
  return message;
}

RemoteError ErrorFromWire(const wire::Error& message) {
  const bool is_known = message.code() >= static_cast<int>(StatusCode::kInvalidArgument) &&
                        message.code() <= static_cast<int>(StatusCode::kInternal);
  const auto code = is_known ? static_cast<StatusCode>(message.code()) : StatusCode::kInternal;
  const auto reason = StatusReasonByName(message.reason());
  const Status status = Status(code, message.message()).WithReason(reason);
  const std::uint32_t asked_ms = message.retry() ? message.retry_after_ms() : 0;
  return {asked_ms > 0 ? status.WithRetryAfter(asked_ms) : status, message.retry()};
}

}  // namespace atlas
