// Why nothing more is read from a peer, for the counters and the log, where it is the peer's doing.
#pragma once

#include "core/base/status.h"
#include "core/base/str_cat.h"
#include "server/net/peer_record.h"
#include "server/net/stream/peer_stream.h"

namespace atlas {

// `broken`: the rule of the protocol that it broke, or the limit that it met; ok: neither.
inline void NoteReadingEnd(const PeerRecord& peer, const PeerStream& stream, const Status& broken) {
  if (broken.code() == StatusCode::kInvalidData) {
    peer.counters.broken_frames.Add();
  }
  if (stream.is_shaking_hands()) {
    peer.counters.handshakes_failed.Add();
  }
  if (!stream.failure().empty()) {
    peer.Warn(StrCat("TLS: ", stream.failure()));
  }
}

}  // namespace atlas
