// Keyframes of one peer that were refused and may be sent again. Until they are, so is every one
// behind them in their session refused: before the last sequence number of a session nothing is
// missing that somebody still wants to send, whatever became of the message that refused it. One
// peer may send for many vehicles: each has a count of its own. Thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <set>
#include <string>

#include "core/base/status.h"
#include "core/geometry/keyframe_key.h"

namespace atlas {

class MissingUploads {
 public:
  // kUnavailable: one before it is missing, or may be: more of its vehicle than are counted.
  Status CheckTurn(const KeyframeKey& key) const;
  // What became of it. Before the turn of the next one is checked.
  void NoteEnd(const KeyframeKey& key, const Status& status);

 private:
  // Of a vehicle, more than it sends before it hears of the first. Beyond it nobody knows what is
  // missing, and nothing else of it is taken on this connection.
  static constexpr std::size_t kMaxMissing = 1'024;
  static constexpr std::size_t kMaxVehicles = 1'024;  // the same for all others

  struct Vehicle {
    std::map<std::string, std::set<std::uint32_t>> sessions;
    std::size_t size = 0;
    bool is_overfull = false;
  };

  mutable std::mutex mutex_;
  std::map<std::string, Vehicle> vehicles_;
  bool is_overfull_ = false;
};

}  // namespace atlas
