#include "core/base/status.h"

namespace atlas {

std::string_view StatusCodeName(StatusCode code) {
  switch (code) {
    case StatusCode::kOk:
      return "ok";
    case StatusCode::kInvalidArgument:
      return "invalid_argument";
    case StatusCode::kInvalidData:
      return "invalid_data";
    case StatusCode::kNotFound:
      return "not_found";
    case StatusCode::kConflict:
      return "conflict";
    case StatusCode::kUnavailable:
      return "unavailable";
    case StatusCode::kTimeout:
      return "timeout";
    case StatusCode::kResourceExhausted:
      return "resource_exhausted";
    case StatusCode::kUnsupported:
      return "unsupported";
    case StatusCode::kPermissionDenied:
      return "permission_denied";
    case StatusCode::kInternal:
      return "internal";
  }
  return "unknown";
}

std::string_view StatusReasonName(StatusReason reason) {
  switch (reason) {
    case StatusReason::kNone:
      return "";
    case StatusReason::kQuota:
      return "quota";
    case StatusReason::kStoreLimit:
      return "store_limit";
    case StatusReason::kDiskFloor:
      return "disk_floor";
  }
  return "";
}

StatusReason StatusReasonByName(std::string_view name) {
  for (const StatusReason reason :
       {StatusReason::kQuota, StatusReason::kStoreLimit, StatusReason::kDiskFloor}) {
    if (StatusReasonName(reason) == name) {
      return reason;
    }
  }
  return StatusReason::kNone;
}

Status Status::WithContext(std::string_view context) const {
  Status status = *this;
  if (!ok()) {
    status.message_ = std::string(context) + ": " + message_;
  }
  return status;
}

Status Status::WithReason(StatusReason reason) const {
  Status status = *this;
  status.reason_ = reason;
  return status;
}

Status Status::WithRetryAfter(std::int64_t retry_after_ms) const {
  Status status = *this;
  status.retry_after_ms_ = retry_after_ms;
  return status;
}

}  // namespace atlas
