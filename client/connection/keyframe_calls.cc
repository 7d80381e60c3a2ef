// What AtlasClient asks of keyframes: which a session has, what they are, that their poses are
// corrected, and that this is undone.
#include <chrono>
#include <utility>

#include "client/connection/atlas_client.h"
#include "client/connection/rpc_channel.h"
#include "core/base/str_cat.h"
#include "proto/wire/convert.h"

namespace atlas {
namespace {

using Body = wire::Envelope;

constexpr std::uint32_t kMinorWithKeyframes = 10;
constexpr std::uint32_t kMinorWithReading = 11;
constexpr std::uint32_t kMinorWithTerms = 11;

PoseBatchSummary BatchFromWire(const wire::UpdatePosesReply& done) {
  PoseBatchSummary batch{done.updated(), done.tiles_marked(), done.revision(), done.batch(),
                         done.compacted()};
  for (const wire::UpdatePosesReply::SessionChange& session : done.sessions()) {
    batch.sessions.push_back(
        {{session.vehicle(), session.session()}, session.state(), session.reason()});
  }
  return batch;
}

Result<SessionKeyframe> KeyframeFromWire(const wire::KeyframeMessage& message) {
  SessionKeyframe keyframe;
  keyframe.sequence = message.sequence();
  keyframe.damage = message.damage();
  if (!keyframe.damage.empty()) return keyframe;
  keyframe.time_ms = message.time_ms();
  const Result<QuantizedPose> pose = PoseFromWire(message.pose());
  if (!pose) return Error(pose.error());
  keyframe.T_world_sensor = *pose;
  if (message.has_prior()) {
    const wire::PositionPrior& prior = message.prior();
    keyframe.prior = {prior.x_um(), prior.y_um(), prior.z_um(), prior.radius_mm()};
  }
  const ByteSpan blob = BytesFromWire(message.blob());
  keyframe.blob.assign(blob.begin(), blob.end());
  return keyframe;
}

Status NotInOrder(const SessionKey& session, std::uint32_t sequence, std::uint32_t before) {
  return {StatusCode::kInvalidData,
          StrCat("keyframes of ", session, ": the daemon told of ", sequence, " behind ", before,
                 ", expected them in order")};
}

Status NoneCame(const SessionKey& session) {
  return {StatusCode::kInvalidData,
          StrCat("keyframes of ", session, ": the daemon has more and told none")};
}

// One reply after the other, until there is no more.
class KeyframeReader {
 public:
  KeyframeReader(RpcChannel& channel,
                 const SessionKey& session,
                 std::optional<std::uint32_t> after,
                 const AtlasClient::KeyframeCallback& on_keyframe)
      : channel_(channel), session_(session), last_(after), on_keyframe_(on_keyframe) {}

  Result<SessionReading> ReadAll() {
    while (true) {
      const std::uint64_t before = reading_.keyframes;
      const Result<wire::KeyframesEnd> end = ReadReply();
      if (!end) return Error(end.error());
      if (before == 0) reading_.revision = end->revision();
      if (reading_.keyframes - before != end->keyframes()) {
        return Error(
            channel_.Break({StatusCode::kInvalidData,
                            StrCat("keyframes of ", session_, ": ", end->keyframes(),
                                   " were to come, ", reading_.keyframes - before, " came")}));
      }
      if (!end->has_more()) return reading_;
      if (reading_.keyframes == before) return Error(channel_.Break(NoneCame(session_)));
    }
  }

 private:
  Result<wire::KeyframesEnd> ReadReply() {
    wire::Envelope request;
    wire::ReadKeyframes& message = *request.mutable_read_keyframes();
    message.set_vehicle(session_.vehicle);
    message.set_session(session_.session);
    if (last_) message.set_after_sequence(*last_);
    const Result<std::uint64_t> id = channel_.Send(request);
    if (!id) return Error(id.error());
    while (true) {
      const auto reply = channel_.ReceiveFor(*id, Body::kKeyframe, Body::kKeyframesEnd);
      if (!reply) return Error(reply.error());
      if (reply->has_keyframes_end()) return reply->keyframes_end();
      if (Status status = Take(reply->keyframe()); !status.ok()) return Error(std::move(status));
    }
  }

  Status Take(const wire::KeyframeMessage& message) {
    Result<SessionKeyframe> keyframe = KeyframeFromWire(message);
    if (!keyframe) {
      return channel_.Break(keyframe.error().WithContext(StrCat("keyframes of ", session_)));
    }
    if (last_ && keyframe->sequence <= *last_) {
      return channel_.Break(NotInOrder(session_, keyframe->sequence, *last_));
    }
    last_ = keyframe->sequence;
    ++reading_.keyframes;
    reading_.damaged += keyframe->damage.empty() ? 0U : 1U;
    return on_keyframe_(*std::move(keyframe));
  }

  RpcChannel& channel_;
  const SessionKey& session_;
  std::optional<std::uint32_t> last_;
  const AtlasClient::KeyframeCallback& on_keyframe_;
  SessionReading reading_;
};

// Until the reply, besides the usual time: one takes a daemon 0.3 ms, and a tenth of that speed is
// borne.
std::chrono::milliseconds TimeForPoses(std::size_t poses) {
  return std::chrono::milliseconds(3 * poses);
}

}  // namespace

Result<PoseBatchSummary> AtlasClient::UpdatePoses(std::span<const PoseCorrection> corrections,
                                                  const std::string& author,
                                                  const BatchTerms& terms) {
  if (corrections.size() + terms.published.size() > kMaxRepeatedFields) {
    return Error(StatusCode::kInvalidArgument,
                 StrCat("pose batch: ", corrections.size() + terms.published.size(),
                        " poses and sessions, at most ", kMaxRepeatedFields));
  }
  if (terms.if_revision != 0 || !terms.published.empty()) {  // an older one would ignore them
    Status status = CheckMinor(kMinorWithTerms, "a batch with a condition, or that publishes,");
    if (!status.ok()) return Error(std::move(status));
  }
  wire::Envelope request;
  wire::UpdatePoses& update = *request.mutable_update_poses();
  update.set_author(author);
  update.set_if_revision(terms.if_revision);
  for (const SessionKey& session : terms.published) {
    wire::SessionName& name = *update.add_publish();
    name.set_vehicle(session.vehicle);
    name.set_session(session.session);
  }
  for (const PoseCorrection& correction : corrections) {
    wire::PoseUpdate& pose = *update.add_updates();
    *pose.mutable_key() = KeyToWire(correction.key);
    *pose.mutable_pose() = PoseToWire(correction.T_world_sensor);
  }
  const auto reply =
      channel_->Call(request, Body::kUpdatePosesReply, TimeForPoses(corrections.size()));
  if (!reply) return Error(reply.error());
  return BatchFromWire(reply->update_poses_reply());
}

Result<PoseBatchSummary> AtlasClient::UndoPoses(std::uint64_t batch, const std::string& author) {
  if (Status status = CheckMinor(kMinorWithTerms, "to undo a batch"); !status.ok()) {
    return Error(std::move(status));
  }
  wire::Envelope request;
  request.mutable_undo_poses()->set_batch(batch);
  request.mutable_undo_poses()->set_author(author);
  // How many there are the daemon knows.
  const auto reply =
      channel_->Call(request, Body::kUpdatePosesReply, TimeForPoses(kMaxRepeatedFields));
  if (!reply) return Error(reply.error());
  return BatchFromWire(reply->update_poses_reply());
}

Result<std::vector<KeyframeSummary>> AtlasClient::ListKeyframes(const SessionKey& session) {
  if (Status status = session.Validate(); !status.ok()) return Error(std::move(status));
  if (Status status = CheckMinor(kMinorWithKeyframes, "a list of keyframes"); !status.ok()) {
    return Error(std::move(status));
  }
  std::vector<KeyframeSummary> keyframes;
  while (true) {
    wire::Envelope request;
    wire::KeyframesRequest& page = *request.mutable_keyframes_request();
    page.set_vehicle(session.vehicle);
    page.set_session(session.session);
    if (!keyframes.empty()) page.set_after_sequence(keyframes.back().sequence);
    const auto reply = channel_->Call(request, Body::kKeyframesReply);
    if (!reply) return Error(reply.error());
    const wire::KeyframesReply& told = reply->keyframes_reply();
    for (const wire::KeyframeInfo& info : told.keyframes()) {
      const Result<QuantizedPose> pose = PoseFromWire(info.pose());
      if (!pose) return Error(pose.error().WithContext(StrCat("keyframes of ", session)));
      if (!keyframes.empty() && info.sequence() <= keyframes.back().sequence) {
        return Error(NotInOrder(session, info.sequence(), keyframes.back().sequence));
      }
      keyframes.push_back({info.sequence(), info.time_ms(), *pose});
    }
    if (!told.has_more()) return keyframes;
    if (told.keyframes().empty()) return Error(NoneCame(session));
  }
}

Result<SessionReading> AtlasClient::ReadKeyframes(const SessionKey& session,
                                                  std::optional<std::uint32_t> after_sequence,
                                                  const KeyframeCallback& on_keyframe) {
  Status status = session.Validate();
  status = status.ok() ? CheckMinor(kMinorWithReading, "to read keyframes") : std::move(status);
  if (!status.ok()) return Error(std::move(status));
  return KeyframeReader(*channel_, session, after_sequence, on_keyframe).ReadAll();
}

}  // namespace atlas
