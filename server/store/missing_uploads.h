// Keyframes of one peer that were refused and may be sent again. Until they are, so is every one
// behind them in their session refused: before the last sequence number of a session nothing is
// missing that somebody still wants to send, whatever became of the message that refused it.
// Thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <set>

#include "core/base/status.h"
#include "core/geometry/keyframe_key.h"

namespace atlas {

class MissingUploads {
 public:
  // kUnavailable: one before it is missing.
  Status CheckTurn(const KeyframeKey& key) const;
  // What became of it. Before the turn of the next one is checked.
  void NoteEnd(const KeyframeKey& key, const Status& status);

 private:
  // More than a peer sends before it hears of the first. Beyond it nothing else is taken.
  static constexpr std::size_t kMaxMissing = 1'024;

  mutable std::mutex mutex_;
  std::map<SessionKey, std::set<std::uint32_t>> sessions_;
  std::size_t size_ = 0;
  bool is_overfull_ = false;
};

}  // namespace atlas
