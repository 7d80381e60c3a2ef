#include "client/connection/keyframe_uploader.h"

#include <algorithm>

#include "client/connection/rpc_channel.h"
#include "core/base/str_cat.h"
#include "proto/wire/convert.h"

namespace atlas {
namespace {

wire::Envelope UploadRequest(const KeyframeUpload& upload) {
  wire::Envelope request;
  wire::UploadKeyframe& message = *request.mutable_upload_keyframe();
  *message.mutable_key() = KeyToWire(upload.key);
  message.set_time_ms(upload.time_ms);
  *message.mutable_pose() = PoseToWire(upload.T_world_sensor);
  message.set_blob(BytesToWire(upload.blob));
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

KeyframeUploader::KeyframeUploader(AtlasClient& client, const UploadOptions& options)
    : client_(client), options_(options) {}

bool KeyframeUploader::IsFull(std::size_t next_bytes) const {
  return !in_flight_.empty() && (in_flight_.size() >= options_.max_in_flight ||
                                 in_flight_bytes_ + next_bytes > options_.max_in_flight_bytes);
}

Status KeyframeUploader::Upload(const KeyframeUpload& upload) {
  while (IsFull(upload.blob.size())) {
    ATLAS_RETURN_IF_ERROR(ReceiveOne());
  }
  ATLAS_RETURN_IF_ERROR(first_refusal_);
  wire::Envelope request = UploadRequest(upload);
  const std::uint64_t bytes_before = client_.bytes_sent();
  const Result<std::uint64_t> id = client_.channel_->Send(request);
  if (!id) return id.error().WithContext(StrCat("keyframe ", upload.key));
  in_flight_.push_back({*id, upload.key, upload.blob.size()});
  in_flight_bytes_ += upload.blob.size();
  totals_.bytes_sent += client_.bytes_sent() - bytes_before;
  ++totals_.sent;
  return {};
}

void KeyframeUploader::NoteRefusal(const InFlight& upload, const Status& refusal) {
  const Status named = Named(refusal, upload.key);
  if (options_.on_answer) {
    options_.on_answer(upload.key, named);
  } else if (first_refusal_.ok()) {
    first_refusal_ = named;
  }
}

Status KeyframeUploader::ReceiveOne() {
  const Result<wire::Envelope> reply = client_.channel_->Receive();
  if (!reply) return reply.error();
  const auto entry = std::find_if(
      in_flight_.begin(), in_flight_.end(),
      [&reply](const InFlight& upload) { return upload.request_id == reply->request_id(); });
  if (entry == in_flight_.end()) return {};  // of a request that was given up
  if (reply->has_error()) {
    NoteRefusal(*entry, ErrorFromWire(reply->error()).status);
  } else if (!reply->has_upload_reply()) {
    return {StatusCode::kInvalidData,
            StrCat("keyframe ", entry->key, ": the daemon answered with something else")};
  } else {
    const wire::UploadReply& ack = reply->upload_reply();
    ++totals_.acked;
    totals_.duplicates += ack.duplicate() ? 1U : 0U;
    totals_.tiles_marked += ack.tiles_marked();
    totals_.revision = std::max(totals_.revision, ack.revision());
    if (options_.on_answer) options_.on_answer(entry->key, {});
  }
  in_flight_bytes_ -= entry->size_bytes;
  in_flight_.erase(entry);
  return {};
}

Status KeyframeUploader::Finish() {
  while (!in_flight_.empty()) {
    ATLAS_RETURN_IF_ERROR(ReceiveOne());
  }
  return first_refusal_;
}

}  // namespace atlas
