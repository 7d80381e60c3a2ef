#include "tests/client/link_faults/tile_watcher.h"

#include <gtest/gtest.h>

#include "client/connection/atlas_client.h"
#include "tests/server/net/blocking_peer.h"

namespace atlas::testing {
namespace {

constexpr std::uint64_t kWatchId = 2;

wire::Envelope WatchEverywhere() {
  wire::Envelope request;
  request.set_request_id(kWatchId);
  request.mutable_watch_request()->mutable_area()->mutable_disc()->set_radius_um(1'000'000'000);
  return request;
}

}  // namespace

TileWatcher::TileWatcher(const Endpoint& daemon, const Endpoint& link)
    : daemon_(daemon), link_(link), thread_([this] { Run(); }) {}

TileWatcher::~TileWatcher() {
  is_stopping_ = true;
  thread_.join();
}

void TileWatcher::Run() {
  while (!is_stopping_) {
    WatchOnce();
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

void TileWatcher::WatchOnce() {
  BlockingPeer peer(link_.port);
  if (!peer.is_connected() || !peer.Greet().has_hello_reply()) return;
  if (!peer.Send(WatchEverywhere())) return;
  const auto first = peer.Receive();
  if (!first || !first->has_watch_event()) return;
  ++watches_;
  LookAtAll();
  for (auto next = peer.Receive(); next && next->has_watch_event(); next = peer.Receive()) {
    Note(next->watch_event());
  }
}

void TileWatcher::LookAtAll() {
  ConnectionOptions options;
  options.endpoint = daemon_;
  auto client = AtlasClient::Connect(options);
  ASSERT_TRUE(client) << client.error().message();
  Revisions revisions;
  ASSERT_TRUE(client->QueryRegion({}, [&](const TileBlob& tile) {
    revisions[tile.id] = tile.revision;
    return Status();
  }));
  const std::lock_guard lock(mutex_);
  known_ = std::move(revisions);
  changed_.notify_all();
}

void TileWatcher::Note(const wire::WatchEvent& event) {
  EXPECT_FALSE(event.anything() || event.below_size() > 0);
  const std::lock_guard lock(mutex_);
  for (int i = 0; i < event.keys_size(); ++i) {
    const auto id = TileId::FromKey(event.keys(i));
    ASSERT_TRUE(id);
    ++told_;
    if (event.revisions(i) == 0) {
      known_.erase(*id);
    } else {
      known_[*id] = event.revisions(i);
    }
  }
  changed_.notify_all();
}

bool TileWatcher::Await(const Revisions& revisions, std::chrono::seconds patience) {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, patience, [&] { return known_ == revisions; });
}

}  // namespace atlas::testing
