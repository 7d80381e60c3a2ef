// Watches all of an atlas over a link that fails: as soon as it is lost it comes back, and looks at
// the whole atlas once, behind the watch's first event. Between these it knows what it is told, and
// no more.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <thread>

#include "client/connection/endpoint.h"
#include "core/geometry/tile_id.h"
#include "proto/wire/envelope.h"

namespace atlas::testing {

class TileWatcher {
 public:
  using Revisions = std::map<TileId, std::uint64_t>;

  // Watches through `link`; the whole atlas comes from the daemon itself.
  TileWatcher(const Endpoint& daemon, const Endpoint& link);
  // The link is to be gone: it waits for what it says.
  ~TileWatcher();
  TileWatcher(const TileWatcher&) = delete;
  TileWatcher& operator=(const TileWatcher&) = delete;
  TileWatcher(TileWatcher&&) = delete;
  TileWatcher& operator=(TileWatcher&&) = delete;

  // True once these are what it knows, false when it does not come to that.
  bool Await(const Revisions& revisions, std::chrono::seconds patience);
  std::uint64_t watches() const { return watches_; }
  std::uint64_t told() const { return told_; }

 private:
  void Run();
  void WatchOnce();
  void LookAtAll();
  void Note(const wire::WatchEvent& event);

  Endpoint daemon_;
  Endpoint link_;
  std::mutex mutex_;
  std::condition_variable changed_;
  Revisions known_;
  std::atomic<bool> is_stopping_{false};
  std::atomic<std::uint64_t> watches_{0};  // that began
  std::atomic<std::uint64_t> told_{0};     // changes of tiles
  std::thread thread_;
};

}  // namespace atlas::testing
