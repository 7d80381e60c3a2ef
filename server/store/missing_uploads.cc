#include "server/store/missing_uploads.h"

#include "core/base/str_cat.h"

namespace atlas {
namespace {

Status NobodyKnows(const KeyframeKey& key) {
  return {StatusCode::kUnavailable,
          StrCat("keyframe ", key,
                 ": too many were refused before it; connect again, and go on "
                 "behind the last one that is there")};
}

}  // namespace

Status MissingUploads::CheckTurn(const KeyframeKey& key) const {
  const std::lock_guard lock(mutex_);
  const auto vehicle = vehicles_.find(key.session.vehicle);
  if (vehicle == vehicles_.end()) {
    return is_overfull_ ? NobodyKnows(key) : Status();
  }
  const auto& sessions = vehicle->second.sessions;
  const auto session = sessions.find(key.session.session);
  if (session == sessions.end()) {
    return vehicle->second.is_overfull ? NobodyKnows(key) : Status();
  }
  const std::uint32_t first = *session->second.begin();
  if (key.sequence > first) {
    return {StatusCode::kUnavailable,
            StrCat("keyframe ", key, ": ", first,
                   " of its session was refused before it and is missing; "
                   "send that one again first")};
  }
  return {};
}

void MissingUploads::NoteEnd(const KeyframeKey& key, const Status& status) {
  const std::lock_guard lock(mutex_);
  auto vehicle = vehicles_.find(key.session.vehicle);
  if (IsTemporary(status.code())) {
    if (vehicle == vehicles_.end()) {
      if (vehicles_.size() == kMaxVehicles) {
        is_overfull_ = true;
        return;
      }
      vehicle = vehicles_.try_emplace(key.session.vehicle).first;
    }
    Vehicle& of = vehicle->second;
    if (of.size == kMaxMissing) {
      of.is_overfull = true;
    } else if (of.sessions[key.session.session].insert(key.sequence).second) {
      ++of.size;
    }
    return;
  }
  if (vehicle == vehicles_.end()) {
    return;
  }
  Vehicle& of = vehicle->second;
  const auto session = of.sessions.find(key.session.session);
  if (session == of.sessions.end() || session->second.erase(key.sequence) == 0) {
    return;
  }
  --of.size;
  if (session->second.empty()) {
    of.sessions.erase(session);
  }
  if (of.sessions.empty() && !of.is_overfull) {
    vehicles_.erase(vehicle);
  }
}

}  // namespace atlas
