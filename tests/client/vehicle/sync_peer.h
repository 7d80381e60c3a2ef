// A daemon that answers syncs about a small atlas: from the rules of docs/protocol.md, without
// priorities. Its connections break where a test wants it. Watches hear what a test tells.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <utility>
#include <vector>

#include "tests/client/support/test_peer.h"
#include "tests/client/vehicle/tiny_world.h"

namespace atlas {

// One connection to a daemon with this world. Change the world only while nothing is asked. All its
// waits end after 10 s.
class SyncPeer {
 public:
  static constexpr int kNever = 1 << 30;

  // Closes the connection when so many frames of replies were sent.
  explicit SyncPeer(const TinyWorld& world, int frames_until_cut = kNever);
  ~SyncPeer() { Release(); }
  SyncPeer(const SyncPeer&) = delete;
  SyncPeer& operator=(const SyncPeer&) = delete;
  SyncPeer(SyncPeer&&) = delete;
  SyncPeer& operator=(SyncPeer&&) = delete;

  // The answer to the Hello waits until it is released.
  void HoldGreeting();
  // In the middle of the frame after `frames` more it falls silent, until it is released.
  void FallSilentAfter(int frames);
  void Release();

  enum class Watches { kTaken, kRefused, kLeftWaiting };
  // Those that are asked for from now on.
  void SetWatches(Watches watches);
  // To the last one that was taken.
  void TellChange(const TileId& id);
  void EndWatch();

  ConnectionOptions options() const { return peer_.options(); }
  int syncs() const { return syncs_; }
  int watches() const { return watches_asked_; }
  int tiles_sent() const { return tiles_sent_; }

 private:
  void Serve(PeerSocket& socket);
  bool Send(PeerSocket& socket, const wire::Envelope& frame);
  // In one piece what is left of a reply: the link acknowledges small ones late.
  bool Flush(PeerSocket& socket) { return socket.Write(std::exchange(unsent_, {})); }
  // False: the request is another one.
  bool AnswerWatch(PeerSocket& socket, const wire::Envelope& request);
  void TellWatch(wire::Envelope reply);

  const TinyWorld& world_;
  std::mutex mutex_;
  std::condition_variable released_;
  bool is_greeting_held_ = false;
  int frames_until_silence_ = kNever;
  int frames_left_;
  Watches watches_ = Watches::kTaken;
  Bytes unsent_;
  PeerSocket* watcher_ = nullptr;  // as long as it is connected
  std::uint64_t watch_id_ = 0;
  std::atomic<int> watches_asked_{0};
  std::atomic<int> syncs_{0};
  std::atomic<int> tiles_sent_{0};
  TestPeer peer_;  // last: its thread uses the others
};

}  // namespace atlas
