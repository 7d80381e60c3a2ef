#include "client/connection/keyframe_uploader.h"

#include <algorithm>
#include <thread>
#include <utility>

#include "client/connection/rpc_channel.h"
#include "core/base/str_cat.h"
#include "proto/wire/convert.h"

namespace atlas {
namespace {

constexpr std::uint32_t kMinorWithStaged = 10;
constexpr auto kNoEnd = std::chrono::steady_clock::time_point::max();
// Of a daemon that is busy and does not say for how long.
constexpr std::chrono::milliseconds kLeastPause{50};

wire::PositionPrior PriorToWire(const KnownPosition& prior) {
  wire::PositionPrior message;
  message.set_x_um(prior.x_um);
  message.set_y_um(prior.y_um);
  message.set_z_um(prior.z_um);
  message.set_radius_mm(prior.radius_mm);
  return message;
}

wire::Envelope UploadRequest(const KeyframeUpload& upload) {
  wire::Envelope request;
  wire::UploadKeyframe& message = *request.mutable_upload_keyframe();
  *message.mutable_key() = KeyToWire(upload.key);
  message.set_time_ms(upload.time_ms);
  *message.mutable_pose() = PoseToWire(upload.T_world_sensor);
  message.set_blob(BytesToWire(upload.blob));
  message.set_staged(upload.is_staged);
  if (upload.prior) *message.mutable_prior() = PriorToWire(*upload.prior);
  return request;
}

// The daemon names the keyframe where the fault is its own.
Status Named(const Status& refusal, const KeyframeKey& key) {
  const std::string name = StrCat("keyframe ", key);
  const std::string& message = refusal.message();
  const bool is_named = message.starts_with(name + ":") || message.starts_with(name + " ");
  return is_named ? refusal : refusal.WithContext(name);
}

}  // namespace

struct KeyframeUploader::Answer {
  const wire::Envelope& envelope;
};

void UploadTotals::Add(const UploadTotals& more) {
  sent += more.sent;
  acked += more.acked;
  duplicates += more.duplicates;
  tiles_marked += more.tiles_marked;
  bytes_sent += more.bytes_sent;
  revision = std::max(revision, more.revision);
}

KeyframeUploader::KeyframeUploader(const AtlasClient& client, const UploadOptions& options)
    : channel_(client.channel_),
      takes_staged_(client.CheckMinor(kMinorWithStaged, "a staged session")),
      options_(options),
      taken_(options_.now()) {}

KeyframeUploader::~KeyframeUploader() {
  const auto channel = channel_.lock();
  if (channel == nullptr) return;
  for (const InFlight& upload : in_flight_) {
    channel->Forget(upload.request_id);
  }
}

bool KeyframeUploader::IsOf(const AtlasClient& client) const {
  return channel_.lock() == client.channel_;
}

Result<std::shared_ptr<RpcChannel>> KeyframeUploader::Channel() const {
  auto channel = channel_.lock();
  if (channel != nullptr) return channel;
  return Error(StatusCode::kUnavailable, "upload: its connection is gone");
}

bool KeyframeUploader::IsFull(std::size_t next_bytes) const {
  return !in_flight_.empty() && (in_flight_.size() >= options_.max_in_flight ||
                                 in_flight_bytes_ + next_bytes > options_.max_in_flight_bytes);
}

Result<bool> KeyframeUploader::AwaitRoom(std::size_t next_bytes, Clock::time_point latest) {
  while (IsFull(next_bytes)) {
    const Result<bool> is_answered = HearOne(latest);
    if (!is_answered || !*is_answered) return is_answered;
  }
  const auto channel = Channel();
  return channel ? (*channel)->IsFree(latest) : Error(channel.error());
}

Status KeyframeUploader::Upload(const KeyframeUpload& upload) {
  if (upload.is_staged) ATLAS_RETURN_IF_ERROR(takes_staged_);
  InFlight next{next_number_++, 0, upload, upload.blob.size(), {}};
  open_.insert(next.number);
  if (options_.patience.count() > 0) {
    if (next.number == 0) taken_ = options_.now();
    next.blob.assign(upload.blob.begin(), upload.blob.end());
    next.upload.blob = next.blob;
  }
  const Result<bool> has_room = AwaitRoom(next.size_bytes, kNoEnd);
  if (!has_room) return has_room.error();
  ATLAS_RETURN_IF_ERROR(SendBusyAgain());
  ATLAS_RETURN_IF_ERROR(first_refusal_);
  return Transmit(std::move(next), kNoEnd);
}

Result<bool> KeyframeUploader::UploadUntil(const KeyframeUpload& upload, Clock::time_point latest) {
  if (upload.is_staged && !takes_staged_.ok()) return Error(takes_staged_);
  const Result<bool> has_room = AwaitRoom(upload.blob.size(), latest);
  if (!has_room || !*has_room) return has_room;
  if (!first_refusal_.ok()) return Error(first_refusal_);
  open_.insert(next_number_);
  Status status = Transmit({next_number_++, 0, upload, upload.blob.size(), {}}, latest);
  if (!status.ok()) return Error(std::move(status));
  return true;
}

Status KeyframeUploader::Transmit(InFlight upload, Clock::time_point latest) {
  const Result<bool> has_room = AwaitRoom(upload.size_bytes, kNoEnd);
  if (!has_room) return has_room.error();
  const auto channel = Channel();
  if (!channel) return channel.error();
  wire::Envelope request = UploadRequest(upload.upload);
  const std::uint64_t bytes_before = (*channel)->connection().bytes_sent();
  const Result<std::uint64_t> id = (*channel)->Send(request, latest);
  if (!id) return id.error().WithContext(StrCat("keyframe ", upload.upload.key));
  upload.request_id = *id;
  in_flight_bytes_ += upload.size_bytes;
  totals_.bytes_sent += (*channel)->connection().bytes_sent() - bytes_before;
  ++totals_.sent;
  in_flight_.push_back(std::move(upload));
  (*channel)->Listen(*id, RpcChannel::Kind::kAnswer,
                     [this](const wire::Envelope& reply) { return OnAnswer({reply}); });
  return {};
}

void KeyframeUploader::NoteRefusal(InFlight upload, const Status& refusal) {
  const Status named = Named(refusal, upload.upload.key);
  const bool is_busy = refusal.code() == StatusCode::kUnavailable;
  // The first of a round decides for those behind it, which wait for it: they are refused a moment
  // later, and it is the one to be named when the patience ends.
  if (is_busy && (!busy_.empty() || options_.now() - taken_ < options_.patience)) {
    busy_.push_back(std::move(upload));
    return;
  }
  if (options_.on_answer) {
    open_.erase(upload.number);
    options_.on_answer(upload.upload.key, named);
  } else if (first_refusal_.ok()) {
    first_refusal_ = named;
  }
}

// All that it refused, before anything behind it: it takes them in no other order. None behind a
// keyframe that it refused for another reason: it never takes those.
Status KeyframeUploader::SendBusyAgain() {
  while (!busy_.empty()) {
    while (!in_flight_.empty()) {
      const Result<bool> is_answered = HearOne(kNoEnd);
      if (!is_answered) return is_answered.error();
    }
    if (!first_refusal_.ok()) {
      busy_.clear();
      return {};
    }
    const auto channel = Channel();
    if (!channel) return channel.error();
    const auto pause = std::max((*channel)->retry_after(), kLeastPause);
    std::this_thread::sleep_for(std::min(pause, options_.patience));
    std::vector<InFlight> again;
    again.swap(busy_);
    std::sort(again.begin(), again.end(),
              [](const InFlight& a, const InFlight& b) { return a.number < b.number; });
    for (InFlight& upload : again) {
      ATLAS_RETURN_IF_ERROR(Transmit(std::move(upload), kNoEnd));
    }
  }
  return {};
}

Status KeyframeUploader::OnAnswer(const Answer& answer) {
  const wire::Envelope& reply = answer.envelope;
  const auto channel = channel_.lock();
  const auto entry = std::find_if(
      in_flight_.begin(), in_flight_.end(),
      [&reply](const InFlight& upload) { return upload.request_id == reply.request_id(); });
  InFlight answered = std::move(*entry);
  in_flight_.erase(entry);
  in_flight_bytes_ -= answered.size_bytes;
  channel->Forget(answered.request_id);
  const KeyframeKey key = answered.upload.key;
  if (reply.has_error()) {
    channel->NoteRetryAfter(reply.error(), RpcChannel::Refused::kUpload);
    NoteRefusal(std::move(answered), ErrorFromWire(reply.error()).status);
    return {};
  }
  if (!reply.has_upload_reply()) {
    return {StatusCode::kInvalidData,
            StrCat("keyframe ", key, ": the daemon answered with something else")};
  }
  const wire::UploadReply& ack = reply.upload_reply();
  taken_ = options_.now();
  ++totals_.acked;
  open_.erase(answered.number);
  totals_.duplicates += ack.duplicate() ? 1U : 0U;
  totals_.tiles_marked += ack.tiles_marked();
  totals_.revision = std::max(totals_.revision, ack.revision());
  if (options_.on_answer) options_.on_answer(key, {});
  return {};
}

Result<bool> KeyframeUploader::HearOne(Clock::time_point latest) {
  const auto channel = Channel();
  if (!channel) return Error(channel.error());
  const std::size_t before = in_flight_.size();
  while (in_flight_.size() == before) {
    const Result<bool> is_told = (*channel)->Hear(latest, RpcChannel::Kind::kAnswer);
    if (!is_told || !*is_told) return is_told;
  }
  return true;
}

Status KeyframeUploader::Finish() {
  while (!in_flight_.empty() || !busy_.empty()) {
    ATLAS_RETURN_IF_ERROR(SendBusyAgain());
    if (in_flight_.empty()) continue;
    const Result<bool> is_answered = HearOne(kNoEnd);
    if (!is_answered) return is_answered.error();
  }
  return first_refusal_;
}

Result<bool> KeyframeUploader::FinishUntil(Clock::time_point latest) {
  while (!in_flight_.empty()) {
    const Result<bool> is_answered = HearOne(latest);
    if (!is_answered || !*is_answered) return is_answered;
  }
  if (!first_refusal_.ok()) return Error(first_refusal_);
  return true;
}

}  // namespace atlas
