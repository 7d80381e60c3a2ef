// A daemon whose connections break as scripted, a link to it, and a clock that moves only when
// either is told to: keyframes by key, a byte each. The daemon outlives its links.
#pragma once

#include <atomic>
#include <chrono>
#include <climits>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "client/connection/keyframe_uploader.h"
#include "client/vehicle/atlas_link.h"
#include "core/base/status.h"
#include "core/geometry/keyframe_key.h"
#include "tests/client/support/test_peer.h"

namespace atlas {

// What an attempt to connect comes to.
struct ScriptedConnection {
  bool is_made = true;             // else nobody answers
  int answers = INT_MAX;           // before it breaks
  int questions = INT_MAX;         // about sessions, before it wants to be left alone with them
  std::chrono::seconds passes{0};  // before each of them
  std::uint64_t epoch = 1;
  // The atlas is one from a backup: as many of its keyframes as were in it, the oldest ones.
  std::optional<std::size_t> restored = std::nullopt;
};

class ScriptedDaemon {
 public:
  using Clock = std::chrono::steady_clock;

  // All connections like this one.
  explicit ScriptedDaemon(const ScriptedConnection& connection = {});
  // In this order; all further ones are like the last.
  explicit ScriptedDaemon(std::vector<ScriptedConnection> connections);

  AtlasLink Link();
  Clock::time_point now() const { return Clock::time_point(std::chrono::milliseconds(now_ms_)); }

  void Store(const KeyframeKey& key, std::uint8_t content);
  void Refuse(const KeyframeKey& key, const Status& refusal);
  // From now on what is taken is answered once answers are released; refusals are not held.
  void HoldAnswers();
  void ReleaseAnswers();

  // Until so many uploads were answered, or ten seconds.
  void AwaitAnswers(std::size_t uploads);

  std::map<KeyframeKey, std::uint8_t> stored() const;
  std::vector<KeyframeKey> came() const;  // of all connections, again and again
  const std::vector<std::chrono::milliseconds>& pauses() const { return pauses_; }  // of the links

 private:
  struct HeldAnswer {
    PeerSocket& socket;
    std::uint64_t request_id;
    wire::Envelope reply;
  };

  LinkEnvironment::Attempt Connect(ConnectionOptions options);
  void Serve(PeerSocket& socket, ScriptedConnection connection);
  void AnswerAll(PeerSocket& socket, ScriptedConnection connection);
  void Answer(PeerSocket& socket, std::uint64_t request_id, wire::Envelope reply);
  void Restore(std::size_t keyframes);
  wire::Envelope Take(const wire::UploadKeyframe& upload);
  wire::Envelope Sessions(const SessionKey& after) const;

  const std::vector<ScriptedConnection> connections_;
  std::atomic<std::int64_t> now_ms_{0};
  std::vector<std::chrono::milliseconds> pauses_;
  std::size_t attempts_ = 0;

  mutable std::mutex mutex_;
  std::condition_variable answering_;
  std::size_t answered_ = 0;
  bool is_held_ = false;
  std::vector<HeldAnswer> held_;
  std::map<KeyframeKey, std::uint8_t> stored_;
  std::vector<KeyframeKey> order_;  // in which they were stored
  std::map<KeyframeKey, Status> refusals_;
  std::vector<KeyframeKey> came_;
  std::vector<std::unique_ptr<TestPeer>> peers_;  // their threads use the rest
};

}  // namespace atlas
