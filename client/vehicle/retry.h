// Which failures may go away by themselves.
#pragma once

#include "core/base/status.h"

namespace atlas {

// A closed or silent peer, a full disk or a limit at the other end, a mistake of its. Never:
// another profile, an unknown version, a missing permission, content that is refused.
inline bool MaySucceedLater(StatusCode code) {
  return IsTemporary(code) || code == StatusCode::kInternal;
}

}  // namespace atlas
