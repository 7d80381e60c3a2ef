#include "tests/client/drive/scripted_daemon.h"

#include <algorithm>
#include <utility>

#include "client/connection/connect_attempt.h"
#include "proto/wire/convert.h"

namespace atlas {

using std::chrono::milliseconds;

ScriptedDaemon::ScriptedDaemon(const ScriptedConnection& connection) : connections_({connection}) {}
ScriptedDaemon::ScriptedDaemon(std::vector<ScriptedConnection> connections)
    : connections_(std::move(connections)) {}

AtlasLink ScriptedDaemon::Link() {
  return AtlasLink({}, {[this] { return now(); },
                        [this](milliseconds time) {
                          pauses_.push_back(time);
                          now_ms_ += time.count();
                        },
                        [] { return 0.999999; },
                        [this](const ConnectionOptions& options) {
                          return Connect(options);
                        }});
}

LinkEnvironment::Attempt ScriptedDaemon::Connect(ConnectionOptions options) {
  const ScriptedConnection& plan = connections_[std::min(attempts_++, connections_.size() - 1)];
  if (!plan.is_made) {
    return [](milliseconds) {
      ConnectProgress progress;
      progress.failure = {StatusCode::kUnavailable, "nobody there"};
      return progress;
    };
  }
  options.endpoint = peers_
                         .emplace_back(std::make_unique<TestPeer>(
                             [this, plan](PeerSocket& socket) { Serve(socket, plan); }))
                         ->endpoint();
  const auto attempt = std::make_shared<ConnectAttempt>(options);
  return [attempt](milliseconds) {
    return attempt->Continue(std::chrono::minutes(1));
  };
}

void ScriptedDaemon::Serve(PeerSocket& socket, ScriptedConnection connection) {
  if (connection.restored) Restore(*connection.restored);
  AnswerHello(socket, {}, {}, {.epoch = connection.epoch});
  AnswerAll(socket, connection);
  {
    const std::lock_guard lock(mutex_);
    held_.clear();
  }
  socket.EndWriting();
  socket.Drain();
}

void ScriptedDaemon::Restore(std::size_t keyframes) {
  const std::lock_guard lock(mutex_);
  for (; order_.size() > keyframes; order_.pop_back()) {
    stored_.erase(order_.back());
  }
}

void ScriptedDaemon::AnswerAll(PeerSocket& socket, ScriptedConnection connection) {
  while (const auto request = socket.ReadRequest()) {
    if (connection.answers-- <= 0) return;
    now_ms_ += milliseconds(connection.passes).count();
    wire::Envelope reply;
    if (request->has_upload_keyframe()) {
      reply = Take(request->upload_keyframe());
    } else if (connection.questions-- <= 0) {
      *reply.mutable_error() = ErrorToWire({StatusCode::kUnavailable, "busy"});
    } else {
      const wire::SessionsRequest& asked = request->sessions_request();
      reply = Sessions({asked.after_vehicle(), asked.after_session()});
    }
    Answer(socket, request->request_id(), std::move(reply));
  }
}

void ScriptedDaemon::Answer(PeerSocket& socket, std::uint64_t request_id, wire::Envelope reply) {
  const std::lock_guard lock(mutex_);
  if (is_held_ && !reply.has_error()) {
    held_.push_back({socket, request_id, std::move(reply)});
  } else {
    answered_ += reply.has_upload_reply() ? 1U : 0U;
    socket.Reply(request_id, std::move(reply));
    answering_.notify_all();
  }
}

void ScriptedDaemon::AwaitAnswers(std::size_t uploads) {
  std::unique_lock lock(mutex_);
  answering_.wait_for(lock, std::chrono::seconds(10), [&] { return answered_ >= uploads; });
}

wire::Envelope ScriptedDaemon::Take(const wire::UploadKeyframe& upload) {
  const KeyframeKey key = *KeyFromWire(upload.key());
  const auto content = static_cast<std::uint8_t>(upload.blob().at(0));
  wire::Envelope reply;
  const std::lock_guard lock(mutex_);
  came_.push_back(key);
  if (const auto refusal = refusals_.find(key); refusal != refusals_.end()) {
    *reply.mutable_error() = ErrorToWire(refusal->second);
    return reply;
  }
  const auto [there, is_new] = stored_.emplace(key, content);
  if (is_new) order_.push_back(key);
  if (there->second != content) {
    *reply.mutable_error() = ErrorToWire({StatusCode::kConflict, "other content"});
    return reply;
  }
  reply.mutable_upload_reply()->set_duplicate(!is_new);
  return reply;
}

wire::Envelope ScriptedDaemon::Sessions(const SessionKey& after) const {
  const std::lock_guard lock(mutex_);
  wire::Envelope reply;
  wire::SessionsReply& sessions = *reply.mutable_sessions_reply();
  for (const auto& [key, content] : stored_) {
    if (key.session <= after) continue;
    const std::int64_t time_ms = key.sequence;
    const bool is_known = sessions.sessions_size() > 0 &&
                          sessions.sessions().rbegin()->session() == key.session.session;
    wire::SessionInfo& info =
        is_known ? *sessions.mutable_sessions()->rbegin() : *sessions.add_sessions();
    info.set_vehicle(key.session.vehicle);
    info.set_session(key.session.session);
    info.set_state("live");
    info.set_keyframes(info.keyframes() + 1);
    if (!is_known) info.set_first_time_ms(time_ms);
    info.set_last_time_ms(time_ms);
    info.set_last_sequence(key.sequence);
  }
  return reply;
}

void ScriptedDaemon::Store(const KeyframeKey& key, std::uint8_t content) {
  const std::lock_guard lock(mutex_);
  if (stored_.insert_or_assign(key, content).second) order_.push_back(key);
}

void ScriptedDaemon::Refuse(const KeyframeKey& key, const Status& refusal) {
  const std::lock_guard lock(mutex_);
  refusals_[key] = refusal;
}

void ScriptedDaemon::HoldAnswers() {
  const std::lock_guard lock(mutex_);
  is_held_ = true;
}

void ScriptedDaemon::ReleaseAnswers() {
  const std::lock_guard lock(mutex_);
  is_held_ = false;
  for (HeldAnswer& held : held_) {
    held.socket.Reply(held.request_id, std::move(held.reply));
  }
  held_.clear();
}

std::map<KeyframeKey, std::uint8_t> ScriptedDaemon::stored() const {
  const std::lock_guard lock(mutex_);
  return stored_;
}

std::vector<KeyframeKey> ScriptedDaemon::came() const {
  const std::lock_guard lock(mutex_);
  return came_;
}

}  // namespace atlas
