#include "server/store/missing_uploads.h"

#include "core/base/str_cat.h"

namespace atlas {

Status MissingUploads::CheckTurn(const KeyframeKey& key) const {
  const std::lock_guard lock(mutex_);
  const auto session = sessions_.find(key.session);
  if (session == sessions_.end()) {
    return is_overfull_ ? Status(StatusCode::kUnavailable,
                                 StrCat("keyframe ", key, ": too many were refused before it"))
                        : Status();
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
  if (IsTemporary(status.code())) {
    if (size_ == kMaxMissing) {
      is_overfull_ = true;
    } else if (sessions_[key.session].insert(key.sequence).second) {
      ++size_;
    }
    return;
  }
  const auto session = sessions_.find(key.session);
  if (session == sessions_.end() || session->second.erase(key.sequence) == 0) {
    return;
  }
  --size_;
  if (session->second.empty()) {
    sessions_.erase(session);
  }
}

}  // namespace atlas
