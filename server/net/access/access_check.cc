#include "server/net/access/access_check.h"

#include <algorithm>
#include <string>

#include "core/base/str_cat.h"
#include "core/geometry/keyframe_key.h"

namespace atlas {
namespace {

Status Deny(const Identity& identity, const std::string& what) {
  return {StatusCode::kPermissionDenied,
          StrCat(identity.name.empty() ? "without a certificate or a token" : identity.name,
                 ", with the role ", RoleName(identity.role), ", may not ", what)};
}

bool IsOwn(const Identity& identity, const wire::KeyframeKey& key) {
  return identity.name.empty() || key.vehicle() == identity.name;
}

Status CheckUpload(const Identity& identity, const wire::UploadKeyframe& upload) {
  if (identity.role != Role::kVehicle) {
    return Deny(identity, "upload keyframes");
  }
  return IsOwn(identity, upload.key())
             ? Status()
             : Deny(identity, StrCat("upload for the vehicle ", NameFrom(upload.key().vehicle())));
}

// Where a vehicle drove is its own, and of those who correct it.
Status CheckKeyframes(const Identity& identity, const std::string& vehicle) {
  const bool is_own =
      identity.role == Role::kVehicle && (identity.name.empty() || vehicle == identity.name);
  return is_own || identity.role == Role::kMerge
             ? Status()
             : Deny(identity, StrCat("read keyframes of ", NameFrom(vehicle)));
}

// It takes a look at every keyframe, for those who correct them.
Status CheckSessions(const Identity& identity, const wire::SessionsRequest& request) {
  return request.changed() && identity.role != Role::kMerge
             ? Deny(identity, "ask when sessions changed")
             : Status();
}

// Who aligns sessions says when they are.
Status CheckChange(const Identity& identity, const wire::ChangeSession& change) {
  const bool is_publish = change.action() == wire::ChangeSession::PUBLISH;
  return is_publish && identity.role == Role::kMerge ? Status() : Deny(identity, "change sessions");
}

Status CheckPoses(const Identity& identity, const wire::UpdatePoses& poses) {
  if (identity.role == Role::kMerge) {
    return {};
  }
  if (poses.publish_size() > 0) {
    return Deny(identity, "publish sessions");
  }
  const bool is_own =
      identity.role == Role::kVehicle &&
      std::all_of(poses.updates().begin(), poses.updates().end(),
                  [&identity](const auto& update) { return IsOwn(identity, update.key()); });
  return is_own ? Status() : Deny(identity, "correct poses of others");
}

}  // namespace

Status CheckMayAsk(const Identity& identity, const wire::Envelope& request) {
  if (identity.role == Role::kAdmin) {
    return {};
  }
  switch (request.body_case()) {
    case wire::Envelope::kUploadKeyframe:
      return CheckUpload(identity, request.upload_keyframe());
    case wire::Envelope::kUpdatePoses:
      return CheckPoses(identity, request.update_poses());
    case wire::Envelope::kKeyframesRequest:
      return CheckKeyframes(identity, request.keyframes_request().vehicle());
    case wire::Envelope::kReadKeyframes:
      return CheckKeyframes(identity, request.read_keyframes().vehicle());
    case wire::Envelope::kSessionsRequest:
      return CheckSessions(identity, request.sessions_request());
    case wire::Envelope::kUndoPoses:
      return identity.role == Role::kMerge ? Status() : Deny(identity, "undo corrections");
    case wire::Envelope::kChangeSession:
      return CheckChange(identity, request.change_session());
    case wire::Envelope::kCompactRequest:
      return Deny(identity, "compact the atlas");
    case wire::Envelope::kBackupRequest:
      return Deny(identity, "back the atlas up");
    case wire::Envelope::kVerifyRequest:
      if (request.verify_request().repair()) {
        return Deny(identity, "repair the atlas");
      }
      return identity.role == Role::kMerge ? Status() : Deny(identity, "verify the atlas");
    case wire::Envelope::kLogRequest:
      return identity.role == Role::kMerge ? Status() : Deny(identity, "read the log");
    default:
      return {};
  }
}

}  // namespace atlas
